"""Odometry as it is noted from TF messages, in any order, late, missing and going back."""

import gc
from itertools import count
import math

from geometry_msgs.msg import TransformStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.ros import tf_odometry
from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.tf_odometry import TfOdometry
from nodlidar_common.survival import Survival
from nodlidar_common.time_order import LEAST_TO_JUMP, TRANSFORM_OUT_OF_ORDER, UNSTAMPED
from nodlidar_common.transforms import MALFORMED
import pytest
import rclpy
from rclpy.time import Time
from tf2_msgs.msg import TFMessage

MS = 1_000_000
START = 1_700_000_000_000 * MS


class Bench:
    """A listener that gets messages by hand, and its samples."""

    def __init__(self, node, period=0.0):
        self.poses, self.samples, self.backs, self.drops = [], 0, 0, []
        self.orientations = []
        self._numbers = count(1)
        survival = Survival(pytest.fail)
        self.tf = TfOdometry(
            node,
            'odom',
            'pivot',
            self._sampled,
            self._went_back,
            survival,
            self.drops.append,
            period,
        )

    def _sampled(self, stamp_ns, position, orientation):
        self.samples += 1
        self.poses.append((stamp_ns, position))
        self.orientations.append(orientation)

    def _went_back(self):
        self.backs += 1
        self.poses.clear()

    def hear(self, ms, x=0.0, parent='odom', child='base', number=None):
        self.hear_all(transform(ms, x, parent, child), number=number)

    def hear_all(self, *transforms, number=None):
        info = {'publication_sequence_number': number or next(self._numbers)}
        self.tf.add(TFMessage(transforms=list(transforms)), info)

    def mount(self, z=1.0):
        message = TFMessage(transforms=[transform(0, 0.0, 'base', 'pivot', z)])
        self.tf.add_static(message)

    def noted(self):
        """Return the time [ms] and x of each sample."""
        return [((stamp_ns - START) // MS, x) for stamp_ns, (x, _, _) in self.poses]


def transform(ms, x, parent, child, z=0.0):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp = time_message(START + ms * MS)
    message.transform.translation.x, message.transform.translation.z = x, z
    return message


class NodeAt:
    """A node whose clock shows a time [ns]."""

    def __init__(self, now_ns):
        self._now = Time(nanoseconds=now_ns)

    def get_clock(self):
        return self

    def now(self):
        return self._now


@pytest.fixture(scope='module')
def node():
    rclpy.init()
    made = rclpy.create_node('test_tf_odometry')
    yield made
    made.destroy_node()
    rclpy.shutdown()


@pytest.fixture
def bench(node):
    made = Bench(node)
    made.mount()
    yield made
    made.tf.unregister()


def test_each_sample_is_noted_at_its_own_time_with_the_fixed_mount(bench):
    for ms, x in ((0, 0.0), (20, 0.1), (500, 0.2)):
        bench.hear(ms, x)
    assert bench.noted() == [(0, 0.0), (20, 0.1), (500, 0.2)]
    assert bench.samples == 3
    assert bench.poses[0] == (START, (0.0, 0.0, 1.0))


def test_stamps_that_jitter_are_evened_in_the_buffer_too(node):
    bench = Bench(node, period=0.1)
    bench.mount()
    for x, ms in enumerate((0, 130, 190, 340, 400)):
        bench.hear(ms, x)
        bench.hear(ms, parent='base', child='arm')
    assert bench.noted() == [(100 * x, x) for x in range(5)]
    at = Time(nanoseconds=START + 130 * MS)
    assert bench.tf.buffer.lookup_transform('odom', 'base', at).transform.translation.x == (
        pytest.approx(1.3)
    )
    assert bench.tf.buffer.can_transform('base', 'arm', at)
    bench.tf.unregister()


def test_before_the_mount_is_known_there_is_no_odometry_and_no_sample(node):
    bench = Bench(node)
    bench.hear(0)
    assert bench.samples == 0
    assert bench.tf.missing_input.startswith("no transform from 'odom' to 'pivot'; `ros2 run")
    bench.mount()
    assert (bench.samples, bench.tf.missing_input) == (1, '')
    bench.tf.unregister()


def test_what_comes_late_or_twice_and_other_frames_are_no_samples(bench):
    for ms in (0, 40, 20, 40):
        bench.hear(ms)
    bench.hear(60, parent='base', child='arm')
    assert [ms for ms, _ in bench.noted()] == [0, 40]


def test_transforms_wait_until_they_are_taken_and_wake_nobody(bench, node):
    sender = node.create_publisher(TFMessage, '/tf', 10)
    while not sender.get_subscription_count():
        rclpy.spin_once(node, timeout_sec=0.01)
    for ms in (0, 20):
        sender.publish(TFMessage(transforms=[transform(ms, 0.0, 'odom', 'base')]))
    for _ in range(20):
        rclpy.spin_once(node, timeout_sec=0.01)
    assert bench.samples == 0
    while bench.samples < 2:
        bench.tf.take()
    assert [ms for ms, _ in bench.noted()] == [0, 20]
    node.destroy_publisher(sender)


def test_a_flood_of_transforms_does_not_keep_the_node(bench, monkeypatch):
    def flood(subscription):
        for ms in count():
            assert ms < tf_odometry.WAITING  # all that waited were taken, and more came meanwhile
            yield TFMessage(transforms=[transform(ms, 0.0, 'odom', 'base')]), {}

    monkeypatch.setattr(tf_odometry, 'taken', flood)
    bench.tf.take()
    assert bench.samples == tf_odometry.MOST_TAKEN


def test_a_transform_that_comes_before_its_clock_has_gone_back_is_kept(bench, monkeypatch):
    """As when a bag begins again: its transforms and its clock are different topics."""
    for ms in (5_000, 5_020):
        bench.hear(ms)
    waiting = [TFMessage(transforms=[transform(ms, 0.0, 'odom', 'base')]) for ms in (5_040, 0, 20)]
    monkeypatch.setattr(tf_odometry, 'taken', lambda _: ((each, {}) for each in waiting))
    bench.tf._clock_went_back()
    bench.hear(40)
    assert (bench.backs, bench.drops) == (1, [])
    assert [ms for ms, _ in bench.noted()] == [0, 20, 40]


def test_of_two_moving_frames_the_slower_one_gives_the_times(bench):
    bench.hear(0, 1.0, 'odom', 'foot')
    assert bench.samples == 0
    bench.hear(0, 0.0, 'foot', 'base')
    bench.hear(20, 2.0, 'odom', 'foot')
    bench.hear(40, 3.0, 'odom', 'foot')
    bench.hear(40, 0.5, 'foot', 'base')
    assert bench.noted() == [(0, 1.0), (40, 3.5)]


def test_when_time_goes_back_all_is_forgotten(bench):
    for ms in (5_000, 5_020):
        bench.hear(ms, 5.0)
    for ms, x in ((100, 1.0), (120, 2.0)):
        bench.hear(ms, x)
    assert bench.backs == 0
    bench.hear(140, 3.0)
    assert (bench.backs, bench.drops) == (1, [])
    assert bench.noted() == [(100, 1.0), (120, 2.0), (140, 3.0)]
    assert bench.tf.buffer.can_transform('odom', 'pivot', time_message(START + 110 * MS))
    assert not bench.tf.buffer.can_transform('odom', 'pivot', time_message(START + 5_010 * MS))


def test_when_a_simulated_clock_goes_back_all_is_forgotten_at_once():
    rclpy.init(context=(context := rclpy.Context()))
    node = rclpy.create_node('simulated', context=context)
    clock = node.get_clock()
    clock._set_ros_time_is_active(True)
    clock.set_ros_time_override(Time(nanoseconds=START + 900 * MS, clock_type=clock.clock_type))
    bench = Bench(node)
    bench.mount()
    bench.hear(900, 9.0)
    clock.set_ros_time_override(Time(nanoseconds=START - 200 * MS, clock_type=clock.clock_type))
    assert bench.backs == 1
    bench.hear(0, 1.0)
    bench.hear(20, 1.0)
    assert bench.noted() == [(0, 1.0), (20, 1.0)]
    bench.tf.unregister()
    node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.mark.parametrize('off_ms', [-3_600_000, -5_000, -1_001, 5_000, 3_600_000])
def test_a_single_transform_of_another_time_is_dropped_and_counted(bench, off_ms):
    for ms in (0, 20, 40, 60, 80):
        bench.hear(ms)
        if ms == 40:
            bench.hear(ms + off_ms, 9.0)
    assert (bench.backs, bench.drops) == (0, [TRANSFORM_OUT_OF_ORDER])
    assert bench.noted() == [(ms, 0.0) for ms in (0, 20, 40, 60, 80)]


def test_a_transform_of_another_time_and_parent_changes_no_frame(bench):
    bench.hear(0, 1.0)
    bench.hear(5_000, 9.0, parent='elsewhere')
    bench.hear(20, 2.0)
    assert bench.noted() == [(0, 1.0), (20, 2.0)]
    assert bench.drops == [TRANSFORM_OUT_OF_ORDER]


@pytest.mark.parametrize('first_ms', [-1_600_000_000_000, 3_600_000])
def test_a_first_transform_of_another_time_is_soon_forgotten(bench, first_ms):
    bench.hear(first_ms, 9.0)
    for ms in (0, 20, 40, 60):
        bench.hear(ms, 1.0)
    assert bench.noted()[-4:] == [(ms, 1.0) for ms in (0, 20, 40, 60)]
    assert bench.drops == []


@pytest.mark.parametrize('ahead_ms', [100, 1_000])
def test_transforms_may_be_ahead_of_others(bench, ahead_ms):
    for ms in (0, 20, 40):
        bench.hear(ms + ahead_ms, 1.0, 'odom', 'foot')
        bench.hear(ms, 0.5, 'foot', 'base')
    assert (bench.backs, bench.drops) == (0, [])


def test_of_two_publishers_with_different_clocks_one_is_heard(bench):
    for ms in range(0, 200, 20):
        bench.hear(ms, 1.0)
        bench.hear(ms - 2_000, 9.0)
    assert bench.backs == 0
    assert bench.noted() == [(ms, 1.0) for ms in range(0, 200, 20)]
    assert set(bench.drops) == {TRANSFORM_OUT_OF_ORDER}


@pytest.mark.parametrize('ahead', [0, 1, 700, 5_000])
def test_two_publishers_of_a_transform_on_the_way_are_told_until_one_ends(
    bench, monkeypatch, ahead
):
    """Their numbers may be equal, as of two programs that start at the same time."""

    def hear(ms, number):
        monkeypatch.setattr(bench.tf, '_node', NodeAt(START + ms * MS))
        bench.hear(ms, parent='odom', child='base', number=number)

    bench.mount()
    numbers = count(1)
    for ms, number in zip(range(0, 1_000, 20), numbers, strict=False):
        hear(ms, number + ahead)
        hear(ms + 7, number)
    assert bench.tf.shared == {"the transform to 'base'": 2}
    for ms, number in zip(range(1_000, 4_000, 20), numbers, strict=False):
        hear(ms, number + ahead)
    assert bench.tf.shared == {}


def test_publishers_of_several_transforms_each_are_one_of_each(bench):
    """A localisation, a base with two transforms, and wheels that another program has as well."""
    bench.mount()
    for k in range(100):
        bench.hear(10 * k, parent='map', child='odom', number=1 + k)
        both = (transform(10 * k, 0.0, 'odom', 'foot'), transform(10 * k, 0.0, 'foot', 'base'))
        bench.hear_all(*both, number=70 + 2 * k)
        bench.hear(10 * k, parent='base', child='wheel', number=71 + 2 * k)
        bench.hear(10 * k, parent='base', child='wheel', number=1 + k)
    assert bench.tf.shared == {}


def test_transforms_seconds_apart_are_heard_at_once(bench, monkeypatch):
    for ms in range(0, 9_000, 3_000):
        monkeypatch.setattr(bench.tf, '_node', NodeAt(START + ms * MS))
        bench.hear(ms)
        assert bench.noted()[-1][0] == ms if ms else bench.samples == 1


def test_time_may_go_back_twice_and_a_stray_between_is_dropped(bench):
    for begin_ms in (90_000, 40_000, 0):
        for ms in (0, 20, 40):
            bench.hear(begin_ms + ms)
        bench.hear(begin_ms + 20_000)
    assert bench.backs == 2
    assert [ms for ms, _ in bench.noted()] == [0, 20, 40]


def test_when_time_goes_back_for_two_frames_it_goes_back_once(bench):
    for begin_ms in (5_000, 0):
        for ms in range(begin_ms, begin_ms + 100, 20):
            bench.hear(ms, 1.0, 'odom', 'foot')
            bench.hear(ms, 0.5, 'foot', 'base')
    assert bench.backs == 1
    assert bench.noted() == [(ms, 1.5) for ms in (40, 60, 80)]


@settings(deadline=None)
@given(st.lists(st.lists(st.integers(-1_600_000_000_000, 400_000_000_000), max_size=2)))
def test_up_to_two_transforms_in_a_row_of_any_time_take_no_odometry_away(node, strays):
    bench, times_ms = Bench(node), count(0, 20)
    bench.mount()
    bench.hear(ms := next(times_ms))
    for wrong in strays:
        for off_ms in wrong:
            if abs(off_ms) > 3_000:
                bench.hear(ms + off_ms, 9.0)
        bench.hear(ms := next(times_ms))
    bench.tf.unregister()
    assert bench.backs == 0
    assert bench.samples == len(strays) + 1


def test_time_of_frames_elsewhere_may_go_back(bench):
    bench.hear(5_000, 5.0)
    for ms in (9_000, 1_000):
        bench.hear(ms, parent='base', child='arm')
        bench.hear(ms, parent='map', child='odom')
    bench.hear(5_020, 6.0)
    assert bench.backs == 0
    assert bench.noted() == [(5_000, 5.0), (5_020, 6.0)]


# The other way round, a frame over the carrier, and one over that of odometry.
LOOPS = {
    'inverse': [('base', 'odom')],
    'above the carrier': [('base', 'arm'), ('arm', 'base')],
    'above odometry': [('map', 'odom'), ('odom', 'map')],
}


@pytest.mark.parametrize('loop', LOOPS.values(), ids=LOOPS)
def test_after_a_loop_of_frames_odometry_continues(bench, loop):
    bench.hear(0, 1.0)
    for parent, child in loop:
        bench.hear(10, 9.0, parent, child)
    assert (bench.drops, bench.tf.missing_input) == ([TfOdometry.LOOP], TfOdometry.LOOP)
    for ms, x in ((20, 2.0), (40, 3.0)):
        bench.hear(ms, x)
    assert bench.noted() == [(0, 1.0), (20, 2.0), (40, 3.0)]
    assert (bench.backs, bench.tf.missing_input) == (0, '')


def test_time_may_go_back_after_a_loop_of_frames(bench):
    bench.hear(5_000, 5.0)
    bench.hear(5_010, parent='base', child='odom')
    bench.hear(9_000, 9.0)
    for ms in (100, 120, 140):
        bench.hear(ms, 1.0)
    assert bench.backs == 1
    assert bench.noted() == [(100, 1.0), (120, 1.0), (140, 1.0)]


def test_a_loop_of_fixed_frames_is_reported(bench):
    bench.tf.add_static(TFMessage(transforms=[transform(0, 0.0, 'pivot', 'odom')]))
    bench.hear(0)
    assert (bench.samples, bench.tf.missing_input) == (0, TfOdometry.LOOP)


@pytest.mark.parametrize(('parent', 'child'), [('', 'base'), ('odom', ''), ('base', 'base')])
def test_a_transform_that_is_not_between_two_frames_is_dropped(bench, parent, child):
    bench.hear(0)
    bench.hear(10, parent=parent, child=child)
    bench.hear(20)
    assert bench.drops == [MALFORMED]
    assert bench.samples == 2


def test_transforms_that_lost_their_stamps_are_dropped_however_many_they_are(bench):
    bench.hear(0)
    for _ in range(3 * LEAST_TO_JUMP):
        bench.hear(-START // MS, 1.0)
    bench.hear(20, 2.0)
    assert bench.drops == [UNSTAMPED] * 3 * LEAST_TO_JUMP
    assert (bench.backs, bench.noted()) == (0, [(0, 0.0), (20, 2.0)])


def test_a_fixed_frame_does_not_move(bench):
    bench.hear(0)
    bench.hear(10, 9.0, 'base', 'pivot')
    bench.hear(20)
    assert bench.drops == [TfOdometry.BOTH]
    assert bench.noted() == [(0, 0.0), (20, 0.0)]


def test_a_moving_frame_is_not_fixed(bench):
    bench.hear(0)
    bench.tf.add_static(TFMessage(transforms=[transform(0, 0.0, 'odom', 'base')]))
    bench.hear(20)
    assert (bench.drops, bench.tf.missing_input) == ([TfOdometry.BOTH], '')
    assert bench.noted() == [(0, 0.0), (20, 0.0)]


@pytest.mark.parametrize('w', [0.0, 5e-324, 0.98, 1.02, 1e200, float('nan')])
def test_a_transform_whose_quaternion_is_not_of_length_1_is_dropped(bench, w):
    wrong = transform(10, 0.0, 'odom', 'base')
    wrong.transform.rotation.w = w
    bench.hear_all(wrong)
    assert (bench.drops, bench.samples) == ([MALFORMED], 0)


@pytest.mark.parametrize('length', [0.9951, 1.0049])
def test_the_lengths_of_quaternions_change_no_pose(bench, length):
    """Three in a row, the fixed one too: a quarter turn to the left each, and then 1 m ahead."""
    chain = [('odom', 'foot'), ('foot', 'base'), ('base', 'pivot')]
    turned = [transform(0, 1.0, parent, child) for parent, child in chain]
    for each in turned:
        each.transform.rotation.z = each.transform.rotation.w = length * math.sqrt(0.5)
    *moving, fixed = turned
    bench.tf.add_static(TFMessage(transforms=[fixed]))
    bench.hear_all(*moving)
    [(_, position)], [orientation] = bench.poses, bench.orientations
    assert position == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    right = (0.0, 0.0, -math.sqrt(0.5), math.sqrt(0.5))
    assert orientation == pytest.approx(right, abs=1e-12)


def test_what_is_missing_between_the_frames_is_named(bench):
    bench.hear(0, parent='base', child='arm')
    assert bench.tf.missing_input.startswith("no transform from 'odom' to 'base'; `ros2 run")
    bench.hear(10, parent='map', child='odom')
    assert bench.tf.missing_input.startswith("no transform from 'map' to 'base'; `ros2 run")
    bench.hear(20)
    bench.hear(30)
    bench.hear(40, parent='map', child='odom')
    assert (bench.samples > 0, bench.tf.missing_input) == (True, '')


def test_a_loop_of_fixed_frames_is_no_way(node):
    bench = Bench(node)
    loop = transform(0, 0.0, 'base', 'pivot'), transform(0, 0.0, 'pivot', 'base')
    bench.tf.add_static(TFMessage(transforms=list(loop)))
    assert bench.tf.missing_input.startswith("no transform from 'odom' to 'pivot'; `ros2 run")
    bench.tf.unregister()


def test_a_frame_that_is_fixed_in_that_of_odometry_has_no_odometry(bench):
    bench.tf.add_static(TFMessage(transforms=[transform(0, 0.0, 'odom', 'base')]))
    assert bench.samples == 0
    assert bench.tf.missing_input == "'pivot' is fixed in 'odom'"


def test_one_after_the_other_may_listen_with_the_clock_of_a_node(node):
    for _ in range(30):
        TfOdometry(
            node, 'odom', 'pivot', lambda *pose: None, lambda: None, Survival(pytest.fail)
        ).unregister()
        gc.collect()  # what is made next may lie where the last one was

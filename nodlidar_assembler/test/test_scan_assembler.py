"""The road of a scan in virtual time: what is assembled, held and dropped, and in which order."""

from dataclasses import replace
import math

from bags import entries_of, recording
from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.bags.sensor_log import assemble_log, SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, Poses
from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig, Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.message_assembler import MessageAssembler
from nodlidar_assembler.scan_assembler import (
    JOINT_WENT_BACK,
    NO_JOINT_AFTER,
    NO_JOINT_BEFORE,
    NO_ODOMETRY_AFTER,
    NO_ODOMETRY_BEFORE,
    ODOMETRY_WENT_BACK,
    ScanAssembler,
)
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import time_ns
import numpy as np
import pytest

MS = 1_000_000
START = 1_700_000_000_000 * MS
UNTURNED = (0.0, 0.0, 0.0, 1.0)
# Two beams 66 ms apart.
GEOMETRY = ScanGeometry(2, 0.0, 1.0, 0.066, 0.02, 5.6)
RANGES = np.ones(2, np.float32)


class Watched(Pipeline):
    """A pipeline that keeps what it was given, and interpolates over any gap."""

    def __init__(self, margin_ms):
        config = PipelineConfig(
            max_joint_gap=3600.0,
            max_odometry_gap=math.inf,
            max_robot_speed=math.inf,
            max_robot_turn_rate=math.inf,
        )
        super().__init__(config)
        self.estimator.margin_ns = margin_ms * MS
        self.given, self.jumped = [], []

    def add_scan(self, scan, sample_ns, sample_pitch, odometry=None, jumped=False):
        self.given.append((ms_of(scan), in_ms(sample_ns), odometry))
        self.jumped.append(jumped)
        return super().add_scan(scan, sample_ns, sample_pitch, odometry, jumped)


class Bench:
    """A ScanAssembler, its clock, and lists of what came out."""

    def __init__(self, deadline=0.3, margin=0, mount=None, **config):
        self.now, self.dropped, self.uncompensated = START, [], []
        self.odometry_of = {}
        self.pipeline = Watched(margin)
        config = AssemblerConfig(deadline=deadline, **config)
        self.assembler = ScanAssembler(config, mount)
        self.assembler._pipeline = self.pipeline

    @property
    def released(self):
        return [(ms, samples) for ms, samples, _ in self.pipeline.given]

    def scan(self, ms):
        self.assembler.add_scan(Scan(START + ms * MS, GEOMETRY, RANGES), self.now)
        self.release()

    def joint(self, ms):
        self.assembler.add_joint_sample(START + ms * MS, 0.1)
        self.release()

    def odometry(self, ms, x=0.0):
        self.assembler.add_odometry(START + ms * MS, (x, 0.0, 0.0), UNTURNED)
        self.release()

    def release(self):
        for outcome in self.assembler.ready(self.now):
            assert (outcome.assembled is None) == bool(outcome.dropped)
            self.odometry_of[ms_of(outcome.scan)] = outcome.odometry
            if outcome.dropped:
                self.dropped.append((ms_of(outcome.scan), outcome.dropped))
            if outcome.uncompensated:
                self.uncompensated.append((ms_of(outcome.scan), outcome.uncompensated))


class MovingBench(Bench):
    """A bench whose base moves, with joint samples wherever scans will be."""

    def __init__(self, **config):
        super().__init__(ego_motion='beam', **config)
        self.joints(range(-1000, 3000, 10))

    def joints(self, stamps_ms):
        for ms in stamps_ms:
            self.joint(ms)

    @property
    def released(self):
        return [(ms, in_ms(odometry.time_ns)) for ms, _, odometry in self.pipeline.given]


def ms_of(scan):
    return (scan.stamp_ns - START) // MS


def in_ms(times_ns):
    return ((times_ns - START) // MS).tolist()


# Scans that repeat


def test_ranges_that_repeat_at_another_pitch_are_dropped_and_those_at_the_same_pitch_are_kept():
    bench = Bench()
    assembler = bench.assembler
    geometry = ScanGeometry(21, 0.0, 0.006, 1e-4, 0.02, 5.6)

    def scan(ms, ranges):
        assembler.add_scan(Scan(START + ms * MS, geometry, np.array(ranges, np.float32)), START)

    for ms in range(0, 1000, 10):  # it stands still, and then nods at 1 rad/s
        assembler.add_joint_sample(START + ms * MS, max(0.0, (ms - 300) / 1000.0))
    near, far = [1.0] * 20 + [math.nan], [2.0] * 20 + [math.nan]
    few = [1.0] * 19 + [math.nan] * 2
    scan(100, near)
    scan(200, near)
    scan(304, near)  # 4 mrad away, of 6 between beams
    scan(400, near)
    scan(500, far)
    scan(600, far)
    scan(700, few)
    scan(800, few)  # so few ranges may repeat by chance
    scan(900, far)
    bench.release()
    repeated = 'the same ranges as before, though the pitch is another'
    assert bench.dropped == [(400, repeated), (600, repeated)]
    assert assembler.drops == {repeated: 2}


# Waiting for joint samples


def test_a_scan_waits_for_the_joint_state_after_its_last_beam():
    bench = Bench()
    bench.joint(0)
    bench.scan(10)
    bench.joint(20)
    bench.joint(75)
    assert bench.released == []
    bench.joint(80)
    assert bench.released == [(10, [0, 20, 75, 80])]


def test_a_scan_that_comes_last_leaves_at_once_with_no_more_than_its_bracket():
    bench = Bench()
    for ms in range(0, 200, 10):
        bench.joint(ms)
    bench.scan(45)
    assert bench.released == [(45, [40, 50, 60, 70, 80, 90, 100, 110, 120])]


def test_without_a_joint_state_before_it_a_scan_is_dropped():
    bench = Bench()
    bench.joint(20)
    bench.scan(10)
    bench.joint(80)
    assert bench.dropped == [(10, NO_JOINT_BEFORE)]
    assert bench.assembler.drops == {NO_JOINT_BEFORE: 1}


def test_at_the_deadline_a_scan_is_dropped_and_the_next_one_is_kept():
    bench = Bench(deadline=0.3)
    bench.joint(0)
    bench.scan(10)
    bench.now += 250 * MS
    bench.scan(100)
    bench.now += 51 * MS
    bench.release()
    assert bench.dropped == [(10, NO_JOINT_AFTER)]
    bench.joint(170)
    assert bench.released == [(100, [0, 170])]


@given(st.permutations([('scan', 100 * k) for k in range(5)] + [('joint', 0), ('joint', 600)]))
def test_whatever_the_order_every_scan_is_released_or_dropped_once_and_in_order(arrivals):
    bench = Bench()
    for kind, ms in arrivals:
        getattr(bench, kind)(ms)
    bench.now += 10_000 * MS
    bench.release()
    left = [ms for ms, _ in bench.released] + [ms for ms, _ in bench.dropped]
    assert sorted(left) == [0, 100, 200, 300, 400]
    order = [ms for kind, ms in arrivals if kind == 'scan']
    assert [ms for ms, _ in bench.released] == [m for m in order if m in dict(bench.released)]


def test_when_time_goes_back_no_old_joint_state_brackets_a_new_scan():
    bench = Bench()
    for ms in range(10_000, 10_200, 10):
        bench.joint(ms)
    bench.scan(10_180)
    for ms in range(0, 200, 10):
        bench.joint(ms)
    bench.scan(45)
    assert bench.dropped == [(10_180, JOINT_WENT_BACK)]
    assert bench.released == [(45, list(range(40, 130, 10)))]


def test_with_a_margin_a_scan_waits_for_it_and_brings_the_states_of_it():
    bench = Bench(margin=50)
    for ms in range(0, 200, 20):
        bench.joint(ms)
    bench.scan(75)
    assert bench.released == []
    bench.joint(200)
    assert bench.released == [(75, list(range(20, 201, 20)))]


def test_where_the_margin_is_missing_a_scan_leaves_at_the_deadline_with_its_bracket():
    bench = Bench(margin=50, deadline=0.3)
    for ms in range(40, 161, 20):
        bench.joint(ms)
    bench.scan(75)
    bench.now += 301 * MS
    bench.release()
    assert bench.dropped == []
    assert bench.released == [(75, list(range(40, 161, 20)))]


def test_a_margin_does_not_replace_the_bracket():
    bench = Bench(margin=50, deadline=0.3)
    for ms in range(80, 141, 20):
        bench.joint(ms)
    bench.scan(75)
    bench.joint(160)
    bench.joint(200)
    bench.scan(145)
    bench.now += 301 * MS
    bench.release()
    assert bench.released == []
    assert bench.dropped == [(75, NO_JOINT_BEFORE), (145, NO_JOINT_AFTER)]


def test_a_clock_that_is_set_back_makes_no_scan_wait_without_end():
    bench = Bench()
    bench.joint(0)
    bench.scan(10)
    bench.now -= 3600_000 * MS
    bench.release()
    assert bench.dropped == [(10, NO_JOINT_AFTER)]


def test_a_restart_drops_what_waits_for_its_reason_and_forgets_the_joint_samples():
    bench = Bench()
    bench.joint(0)
    bench.scan(10)
    bench.assembler.restart('the clock was set')
    bench.scan(20)
    bench.joint(100)
    assert bench.dropped == [(10, 'the clock was set'), (20, NO_JOINT_BEFORE)]


def test_a_scan_that_makes_something_fail_is_not_tried_again():
    bench = Bench()
    bench.joint(0)
    bench.pipeline.add_scan = lambda *given: 1 / 0
    bench.scan(10)
    with pytest.raises(ZeroDivisionError):
        bench.joint(77)
    del bench.pipeline.add_scan
    bench.scan(200)
    bench.joint(270)
    assert [ms for ms, _ in bench.released] == [200]


# Waiting for odometry


def test_a_scan_waits_for_the_odometry_after_its_last_beam():
    bench = MovingBench()
    for ms in (-20, 0):
        bench.odometry(ms)
    bench.scan(10)
    for ms in (20, 40, 60):
        bench.odometry(ms)
    assert not bench.released
    bench.odometry(80)
    assert bench.released == [(10, [0, 20, 40, 60, 80])]


def test_samples_at_the_first_and_last_beam_bracket_it():
    bench = MovingBench()
    for ms, x in ((-20, 0.0), (0, 1.0), (66, 2.0)):
        bench.odometry(ms, x)
    bench.scan(0)
    assert bench.released == [(0, [0, 66])]
    _, _, odometry = bench.pipeline.given[0]
    assert np.array_equal(odometry.poses.position[:, 0], [1.0, 2.0])


def test_odometry_counts_as_jumped_where_its_motion_since_the_last_scan_is_unknown():
    """Odometry of the time between was forgotten, or begins later: no cloud may join the two."""
    bench = MovingBench()
    for begin in (0, 100, 60_000):
        bench.now = START + begin * MS
        bench.joints(range(begin - 100, begin + 200, 10))
        for ms in range(begin, begin + 100, 20):
            bench.odometry(ms)
        bench.scan(begin)
    assert [ms for ms, *_ in bench.pipeline.given] == [0, 100, 60_000]
    assert bench.pipeline.jumped == [True, False, True]


def test_the_newest_sample_comes_with_the_scan():
    bench = MovingBench()
    for ms in (0, 66, 100, 120):
        bench.odometry(ms)
    bench.scan(0)
    assert bench.released == [(0, [0, 66, 100, 120])]


def test_without_compensation_a_scan_has_the_odometry_that_has_come_and_waits_for_none():
    bench = Bench()
    for ms in range(-20, 400, 10):
        bench.joint(ms)
    for ms in (-20, 0, 20, 40):
        bench.odometry(ms)
    bench.scan(10)
    assert in_ms(bench.odometry_of[10].time_ns) == [0, 20, 40]
    assert bench.pipeline.given[0][2] is None  # it does not move the points
    bench.scan(100)  # after the last odometry
    assert bench.odometry_of[100] is None
    bench.odometry(220)
    bench.scan(200)
    assert in_ms(bench.odometry_of[200].time_ns) == [40, 220]
    bench.odometry(300, math.inf)
    bench.scan(290)
    assert bench.odometry_of[290] is None


def test_the_odometry_that_compensates_a_scan_is_the_one_that_limits_follow():
    bench = MovingBench(without_odometry='uncompensated')
    for ms in (0, 80):
        bench.odometry(ms)
    bench.scan(10)
    assert bench.odometry_of[10] is bench.pipeline.given[0][2]
    bench.odometry(120)
    bench.scan(100)
    bench.now += 400 * MS
    bench.release()
    assert bench.uncompensated == [(100, NO_ODOMETRY_AFTER)]
    assert in_ms(bench.odometry_of[100].time_ns) == [80, 120]


def test_the_odometry_is_that_of_the_mounted_frame():
    bench = MovingBench(mount=Pose.from_xyzrpy((0.0, 0.0, 1.0, 0.0, 0.0, 0.0)))
    for ms in (0, 66):
        bench.odometry(ms, 2.0)
    bench.scan(0)
    assert bench.pipeline.given[0][2].poses.position.tolist() == [[2.0, 0.0, 1.0]] * 2


def test_odometry_that_is_stamped_late_counts_from_its_measurement():
    bench = MovingBench(odometry_delay=0.05)
    for ms in (0, 40, 60, 120, 160):
        bench.odometry(ms)
        bench.scan(5) if ms == 40 else None
        assert bench.released == ([] if ms < 121 else [(5, [-10, 10, 70, 110])])


def test_a_scan_waits_longer_for_odometry_that_is_late():
    bench = MovingBench(odometry_delay=0.35)
    bench.odometry(340)
    bench.scan(5)
    bench.now += 600 * MS
    bench.release()
    assert not bench.dropped
    bench.now += 51 * MS
    bench.release()
    assert bench.dropped == [(5, NO_ODOMETRY_AFTER)]


def test_without_odometry_before_it_a_scan_is_given_up_at_once():
    bench = MovingBench()
    bench.scan(10)
    bench.odometry(20)
    bench.odometry(80)
    assert bench.dropped == [(10, NO_ODOMETRY_BEFORE)]


def test_at_the_deadline_for_odometry_a_scan_is_given_up_and_the_next_one_is_kept():
    bench = MovingBench()
    bench.odometry(0)
    bench.scan(10)
    bench.now += 250 * MS
    bench.scan(100)
    bench.now += 51 * MS
    bench.release()
    assert bench.dropped == [(10, NO_ODOMETRY_AFTER)]
    bench.odometry(170)
    assert bench.released == [(100, [0, 170])]


def test_the_deadline_for_odometry_begins_with_the_bracket():
    bench = MovingBench()
    bench.scan(2_950)
    bench.now += 250 * MS
    bench.joint(3_020)
    bench.now += 299 * MS
    bench.release()
    assert not bench.dropped
    bench.now += 2 * MS
    bench.release()
    assert bench.dropped == [(2_950, NO_ODOMETRY_AFTER)]


def test_when_odometry_goes_back_what_waits_is_given_up_and_nothing_old_is_used():
    bench = MovingBench()
    bench.joints(range(10_000, 10_200, 10))
    bench.odometry(10_000)
    bench.scan(10_010)
    bench.joints(range(0, 200, 10))
    for ms in (0, 50, 100, 150):
        bench.odometry(ms)
    bench.scan(45)
    assert bench.dropped == [(10_010, ODOMETRY_WENT_BACK)]
    assert bench.released == [(45, [0, 50, 100, 150])]


def test_a_source_that_knows_that_time_went_back_says_so():
    bench = MovingBench()
    bench.odometry(0)
    bench.scan(10)
    bench.assembler.odometry_went_back()
    bench.release()
    assert bench.dropped == [(10, ODOMETRY_WENT_BACK)]


def test_odometry_that_is_not_finite_is_a_reason():
    bench = MovingBench()
    bench.odometry(0)
    bench.odometry(70, math.inf)
    bench.scan(0)
    assert bench.dropped == [(0, 'odometry that is not finite')]


def test_where_it_is_allowed_a_scan_without_odometry_is_made_uncompensated():
    bench = MovingBench(without_odometry='uncompensated')
    bench.scan(10)
    bench.odometry(20)
    bench.odometry(80)
    assert bench.dropped == []
    assert bench.uncompensated == [(10, NO_ODOMETRY_BEFORE)]
    assert bench.assembler.remarks == {f'uncompensated: {NO_ODOMETRY_BEFORE}': 1}
    assert bench.pipeline.given[0][2] is None


def test_of_a_scan_that_odometry_does_not_place_the_pitch_is_estimated_once():
    bench = MovingBench(without_odometry='uncompensated')
    pipeline = bench.assembler._pipeline = Pipeline(
        AssemblerConfig(ego_motion='beam', without_odometry='uncompensated')
    )
    estimate, estimated = pipeline.estimator.pitch, []

    def counted(*given):
        estimated.append(given)
        return estimate(*given)

    pipeline.estimator.pitch = counted
    for ms, x in ((0, 0.0), (50, 10.0), (100, 0.0), (150, 10.0)):  # it jumps
        bench.odometry(ms, x)
    bench.scan(10)
    bench.scan(60)
    assert [ms for ms, _ in bench.uncompensated] == [10, 60]
    assert len(estimated) == 2


@given(st.permutations([100 * k for k in range(5)]), st.integers(0, 5))
def test_every_scan_is_compensated_or_given_up_once_and_in_order(stamps, when):
    bench = MovingBench()
    bench.odometry(0)
    for k, ms in enumerate(stamps):
        if k == when:
            bench.odometry(600)
        bench.scan(ms)
    bench.now += 10_000 * MS
    bench.release()
    out = bench.dropped if when == 5 else bench.released
    assert [entry[0] for entry in out] == stamps
    assert len(bench.dropped) + len(bench.released) == 5


# The history of odometry


@given(st.lists(st.integers(0, 30_000), max_size=60))
def test_the_history_has_the_last_10_s_of_what_was_newer_each_time(stamps):
    history, expected = OdometryHistory(), []
    for ms in stamps:
        history.add(START + ms * MS, (float(ms), 0.0, 0.0), UNTURNED)
        if not expected or ms > expected[-1]:
            expected = [old for old in expected if old >= ms - 10_000] + [ms]
    kept = history.around(START, START + 30_000 * MS)
    assert in_ms(kept.time_ns) == expected
    assert list(kept.poses.position[:, 0]) == expected


@pytest.mark.parametrize(('ms', 'around'), [(0, [0, 20]), (20, [20, 40]), (40, [20, 40])])
def test_an_instant_at_a_sample_has_another_one_beside_it(ms, around):
    history, at_ns = OdometryHistory(), START + ms * MS
    for each in (0, 20, 40):
        history.add(START + each * MS, (float(each), 0.0, 0.0), UNTURNED)
    kept = history.around(at_ns, at_ns)
    assert in_ms(kept.time_ns) == around
    limits = OdometryConfig(0.1, math.inf, math.inf)
    assert kept.at(np.array([at_ns]), limits).position[0, 0] == ms


def pitch_at(ms):
    return 0.5 * abs(ms % 1400 - 700) / 700


def scan_at(ms):
    return Scan(START + int(ms) * MS, GEOMETRY, RANGES)


def live_clouds(config, stamps_ms, places):
    """Assemble ten scans a second as they arrive, with joint and odometry samples."""
    assembler = ScanAssembler(config)
    clouds = []
    for ms, place in zip(stamps_ms.tolist(), places, strict=True):
        assembler.add_joint_sample(START + ms * MS, pitch_at(ms))
        assembler.add_odometry(START + ms * MS, (place, 0.0, 0.0), UNTURNED)
        if ms % 100 == 0 and ms:
            assembler.add_scan(scan_at(ms), START + ms * MS)
        outcomes = assembler.ready(START + ms * MS)
        clouds += [cloud for each in outcomes if each.assembled for cloud in each.assembled.clouds]
    return clouds, assembler.drops


def clouds_of_log(config, stamps_ms, places):
    """Assemble the same from a log."""
    position = np.zeros((len(places), 3))
    position[:, 0] = places
    poses = Poses(position, np.tile(UNTURNED, (len(places), 1)))
    stamps_ns = START + stamps_ms * MS
    log = SensorLog(
        [scan_at(ms) for ms in stamps_ms[:-10] if ms % 100 == 0 and ms],
        stamps_ns,
        pitch_at(stamps_ms),
        Odometry(stamps_ns, poses),
    )
    return assemble_log(log, config)


@pytest.mark.parametrize('jump_ms', [1030, 1080])
@pytest.mark.parametrize('ego_motion', ['beam', 'deskew'])
@pytest.mark.parametrize('assembled', [live_clouds, clouds_of_log])
def test_no_cloud_has_points_from_before_and_after_a_jump_of_odometry(
    assembled, ego_motion, jump_ms
):
    """All points are 1 m away from a robot at rest; odometry jumps under a scan or beside it."""
    config = AssemblerConfig(ego_motion=ego_motion, cloud_mode='sweep', max_joint_gap=0.2)
    stamps_ms = np.arange(0, 4000, 10)
    clouds, drops = assembled(config, stamps_ms, 2.0 * (stamps_ms > jump_ms))
    assert len(clouds) >= 4
    assert bool(drops) == (jump_ms == 1030)
    for cloud in clouds:
        where = 2.0 * (cloud.time_ns[0] > START + jump_ms * MS) if ego_motion == 'beam' else 0.0
        way = cloud.xyz - (where, 0.0, 0.0)
        np.testing.assert_allclose(np.linalg.norm(way, axis=1), 1.0, atol=0.1)


@pytest.mark.parametrize('dead', ['/scan', '/joint_states'])
def test_an_input_that_is_silent_for_long_is_no_fault_of_clocks(dead):
    entries = [e for e in entries_of(recording(1.0)) if e[1] in ('/scan', '/joint_states')]
    assembler = MessageAssembler(AssemblerConfig(), lambda: '')

    def feed(topic, message):
        if topic == '/scan':
            assembler.add_scan(assembler.scan(message, time_ns(message.header.stamp)), 0)
        else:
            list(assembler.add_joint_state(message))

    for _, topic, message in entries:
        feed(topic, message)
    assert not assembler.missing_input
    alive = next(e for e in entries if e[1] != dead)
    for second in range(1, 100):
        stamp = alive[2].header.stamp
        later = replace(alive[2].header, stamp=replace(stamp, sec=stamp.sec + second))
        feed(alive[1], replace(alive[2], header=later))
    assert not assembler.missing_input
    for _, topic, message in entries:  # now a clock that is 100 s ahead, of what was dead
        stamp = message.header.stamp
        ahead = replace(
            message.header, stamp=replace(stamp, sec=stamp.sec + 200 * (topic == dead))
        )
        feed(topic, replace(message, header=ahead))
    assert 'synchronise the clocks' in assembler.missing_input

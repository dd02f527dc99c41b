"""What is taken and what is counted of scans and joint states that are malformed."""

from collections import Counter
from contextlib import suppress
import math

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.inputs.scan_input import RefusedScanError, ScanInput
from nodlidar_assembler.message_assembler import MessageAssembler
from nodlidar_common.ros.messages import time_message
from nodlidar_common.stamps import time_ns
import numpy as np
import pytest
from sensor_msgs.msg import JointState, LaserScan

NAN, INF = math.nan, math.inf
START_NS = 1_700_000_000 * 10**9
OF_NO_TIME = 'stamp must be after 1970 and before 2038'


def scan(**fields):
    whole = {
        'angle_min': -2.0,
        'angle_increment': 2 * math.pi / 1024,
        'time_increment': 0.1 / 1024,
        'range_min': 0.02,
        'range_max': 5.6,
        'ranges': [1.0] * 682,
    }
    return LaserScan(**(whole | fields))


def joint_state(sec=1_700_000_000, **fields):
    message = JointState(**({'name': ['arm', 'nod'], 'position': [9.0, 0.1]} | fields))
    message.header.stamp.sec = sec
    return message


def refusal_of(message, **parameters):
    with pytest.raises(RefusedScanError) as refusal:
        ScanInput(AssemblerConfig(**parameters)).scan(message, 0)
    return refusal.value


def taken(message, **parameters):
    return ScanInput(AssemblerConfig(**parameters)).scan(message, 0)


def samples_and_drops(message, **parameters):
    drops = Counter()
    samples = JointInput(AssemblerConfig(joint_name='nod', **parameters), drops).samples(message)
    return samples, drops


@pytest.mark.parametrize(
    'fields',
    [
        {},
        {'ranges': [1.0]},
        {'angle_increment': -0.006},
        {'time_increment': 0.0},
        {'range_max': INF},
    ],
)
def test_scans_that_can_be_used_are_passed_on(fields):
    message = scan(**fields)
    found = taken(message)
    assert found.stamp_ns == time_ns(message.header.stamp)
    assert np.array_equal(found.ranges, message.ranges)


@pytest.mark.parametrize(
    ('key', 'value'),
    [
        ('ranges', []),
        ('ranges', [1.0] * 100_000),
        ('angle_min', NAN),
        ('angle_min', 1e30),
        ('angle_increment', NAN),
        ('angle_increment', INF),
        ('angle_increment', 0.0),
        ('time_increment', NAN),
        ('time_increment', INF),
        ('time_increment', 1e30),
        ('time_increment', -1e-4),
        ('time_increment', 1e-44),
        ('time_increment', 1e-30),
        ('time_increment', 1e-9),
        ('time_increment', 1.0),
        ('range_max', NAN),
        ('range_max', 0.0),
    ],
)
def test_a_malformed_scan_is_dropped_and_what_is_wrong_is_named(key, value):
    assert refusal_of(scan(**{key: value})).reason.startswith(f'{key} must be ')


def test_a_scan_before_1970_is_dropped():
    message = scan()
    message.header.stamp.sec = -1
    assert refusal_of(message).reason == OF_NO_TIME


def test_a_scan_stamped_at_its_end_is_taken_from_its_first_beam_on():
    message = scan()
    message.header.stamp.sec, message.header.stamp.nanosec = 5, 10_000_000
    assert taken(message, scan_delay=0.025).stamp_ns == 4_985_000_000


def test_a_scan_that_a_delay_leads_before_1970_is_dropped():
    assert refusal_of(scan(), scan_delay=0.1).reason == OF_NO_TIME


def test_the_time_between_beams_is_as_given_only_where_scans_tell_none():
    assert taken(scan(time_increment=0.0), time_increment=1e-5).geometry.time_increment == 1e-5
    assert taken(scan(), time_increment=1e-5).geometry.time_increment == 0.1 / 1024


@pytest.mark.parametrize(('max_range', 'farthest'), [(0.0, 5.6), (4.0, 4.0), (10.0, 5.6)])
def test_what_is_too_far_is_what_the_scan_or_the_parameter_says(max_range, farthest):
    found = taken(scan(range_max=5.6), max_range=max_range)
    assert found.geometry.range_max == pytest.approx(farthest)


@pytest.mark.parametrize('offset', [-0.045, 0.0, 0.03])
def test_an_offset_moves_what_is_measured_and_nothing_else(offset):
    """Neither codes of the driver become measurements, nor measurements codes."""
    raw = [-INF, -1.0, 0.0, 0.019, 0.1, 1.0, 5.59, 5.61, INF, NAN]
    found = taken(scan(ranges=raw), range_offset=offset)
    measured = found.geometry.measured(found.ranges)
    assert measured.tolist() == [False] * 4 + [True] * 3 + [False] * 3
    np.testing.assert_allclose(found.ranges[measured], [x + offset for x in raw[4:7]], rtol=1e-6)


def test_scans_that_are_wrong_in_the_same_way_have_the_same_reason():
    reasons = {refusal_of(scan(time_increment=-t)).reason for t in (1e-4, 2e-4)}
    assert len(reasons) == 1


@pytest.mark.parametrize(('key', 'value'), [('angle_min', 1e30), ('time_increment', NAN)])
def test_a_refusal_says_the_value_that_is_wrong(key, value):
    refusal = refusal_of(scan(**{key: value}))
    assert str(refusal) == f'{refusal.reason}: {getattr(scan(**{key: value}), key)!r}'


@pytest.mark.parametrize(
    'message',
    [
        joint_state(position=[9.0, NAN]),
        joint_state(position=[9.0, INF]),
        joint_state(position=[9.0, -1e308]),
        joint_state(position=[9.0]),
        joint_state(position=[]),
        joint_state(sec=-1),
    ],
)
def test_malformed_joint_states_are_counted(message):
    assert samples_and_drops(message) == ([], {JointInput.MALFORMED: 1})


def test_joint_states_without_a_stamp_are_counted_as_such():
    message = joint_state(sec=0)
    message.header.stamp.nanosec = 0
    assert samples_and_drops(message) == ([], {JointInput.UNSTAMPED: 1})


def test_a_joint_state_that_has_the_joint_twice_is_dropped():
    message = joint_state(name=['nod', 'wheel', 'nod'], position=[0.1, 7.0, 0.4])
    assert samples_and_drops(message) == ([], {JointInput.TWICE: 1})


def test_other_joints_are_passed_over_and_the_own_one_is_found_among_them():
    assert samples_and_drops(joint_state(name=['arm', 'leg'])) == ([], {})
    ((_, pitch),), drops = samples_and_drops(joint_state())
    assert (pitch, drops) == (0.1, {})


def test_it_is_told_which_joints_there_are_until_the_own_one_is_heard():
    joint = JointInput(AssemblerConfig(joint_name='nod'), Counter())
    assert joint.missing_input == 'no joint state was heard'
    joint.samples(joint_state(name=['leg', 'arm']))
    missing = "no joint state contains 'nod', only 'arm', 'leg': set joint_name"
    assert joint.missing_input == missing
    joint.samples(joint_state())
    assert joint.missing_input == ''


def test_a_joint_of_another_convention_is_taken_as_it_is_meant():
    """A joint that is at 0.3 where the beams are level, goes down, and is stamped 20 ms late."""
    convention = {'joint_positive': 'down', 'joint_zero': 0.3, 'joint_delay': 0.02}
    (sample,), _ = samples_and_drops(joint_state(sec=5), **convention)
    assert sample == (5_000_000_000 - 20_000_000, pytest.approx(0.2))


def test_a_delay_that_leads_before_1970_is_counted():
    message = joint_state(sec=0)
    message.header.stamp.nanosec = 10**8
    found = samples_and_drops(message, joint_delay=0.5)
    assert found == ([], {JointInput.MALFORMED: 1})


def test_scans_by_an_own_clock_are_late_by_the_fastest_of_the_last():
    """The clock began at 18 s and is 100 ppm fast; scans are on their way for 5 to 60 ms."""
    rng = np.random.default_rng(2)
    inputs = ScanInput(AssemblerConfig(scan_clock='device'))
    begins_ns = 1_700_000_000_000_000_000 + np.arange(600) * 100_000_000
    way_ns = rng.uniform(5e6, 60e6, 600).astype(np.int64)
    duration_ns = round(681 * 9.765625e-5 * 1e9)
    errors_ns = []
    for begin_ns, on_way_ns in zip(begins_ns, way_ns, strict=True):
        message = scan()
        device_ns = 18_000_000_000 + int((begin_ns - begins_ns[0]) * 1.0001)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(device_ns, 10**9)
        taken_ns = inputs.scan(message, int(begin_ns + duration_ns + on_way_ns)).stamp_ns
        errors_ns.append(taken_ns - int(begin_ns))
    drift_ns = 50 * 100_000_000 * 1e-4
    for k, error_ns in enumerate(errors_ns):
        fastest_ns = way_ns[max(0, k - 49) : k + 1].min()
        assert -1 <= error_ns - fastest_ns <= drift_ns + 1


@pytest.mark.parametrize('pause_s', [0.5, 1, 2, 5])
@pytest.mark.parametrize('most_on_way_ns', [0, 60_000_000])
def test_scans_that_waited_have_the_stamps_of_an_own_clock_or_are_refused(pause_s, most_on_way_ns):
    """Those that come in the pause are had at its end, all at once. The first scan is fast."""
    inputs = ScanInput(AssemblerConfig(scan_clock='device'))
    rng, end_ns = np.random.default_rng(3), round((10 + pause_s) * 1e9)
    duration_ns = round(681 * 9.765625e-5 * 1e9)
    late_ns, errors_ns, reasons = [], {}, set()
    for k in range(200):
        message = scan()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(k * 10**8, 10**9)
        measured_ns = k * 10**8 + duration_ns
        arrived_ns = measured_ns + (int(rng.uniform(0.0, most_on_way_ns)) if k else 0)
        if 10 * 10**9 <= arrived_ns < end_ns:
            arrived_ns = end_ns
        late_ns.append(arrived_ns - measured_ns)
        try:
            errors_ns[k] = inputs.scan(message, arrived_ns).stamp_ns - k * 10**8
        except RefusedScanError as error:
            reasons.add(error.reason)
    assert -1 <= min(errors_ns.values()) <= max(errors_ns.values()) <= most_on_way_ns
    refused = {k for k in range(200) if k not in errors_ns}
    assert refused <= {k for k, ns in enumerate(late_ns) if ns > 10**9}
    assert refused >= {k for k, ns in enumerate(late_ns) if ns > 10**9 + most_on_way_ns}
    assert len(refused) == pytest.approx(10 * max(pause_s - 1, 0), abs=1)
    assert reasons == ({ScanInput.LATE} if refused else set())


def test_an_own_clock_that_began_anew_is_followed_after_two_scans():
    inputs, errors_ns = ScanInput(AssemblerConfig(scan_clock='device')), {}
    for k in range(100):
        message = scan()
        device_ns = (k if k < 50 else k - 50) * 10**8
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(device_ns, 10**9)
        with suppress(RefusedScanError):
            errors_ns[k] = inputs.scan(message, START_NS + k * 10**8).stamp_ns - k * 10**8
    assert list(errors_ns) == [*range(50), *range(52, 100)]
    assert len(set(errors_ns.values())) == 1


@pytest.mark.parametrize('step_s', [-3600, 0, 3600])
def test_an_own_clock_is_followed_after_the_clock_of_the_host_was_set(step_s):
    inputs = ScanInput(AssemblerConfig(scan_clock='device'))
    taken_ns = []
    for k in range(100):
        if k == 50:
            inputs.shift(step_s * 10**9)
        message = scan()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(k * 10**8, 10**9)
        host_ns = 1_700_000_000 * 10**9 + k * 10**8 + (step_s * 10**9 if k >= 50 else 0)
        taken_ns.append(inputs.scan(message, host_ns).stamp_ns)
    assert np.diff(taken_ns).tolist() == [
        10**8 + (step_s * 10**9 if k == 50 else 0) for k in range(1, 100)
    ]


def test_scans_of_another_frame_are_refused_until_the_first_is_silent():
    inputs = ScanInput(AssemblerConfig())
    reasons = []
    for k, frame in enumerate('aababbbbbbbbbbb'):
        message = scan()
        message.header.frame_id = frame
        message.header.stamp = time_message(1_700_000_000 * 10**9 + k * 10**8)
        try:
            inputs.scan(message, time_ns(message.header.stamp))
        except RefusedScanError as error:
            reasons.append((k, error.reason))
    assert reasons == [(k, ScanInput.OTHER_FRAME) for k in (2, *range(4, 14))]


@pytest.mark.parametrize('scan_clock', ['host', 'device'])
@pytest.mark.parametrize('time_increment', [0.1 / 1024, 0.0])
def test_scans_whose_stamp_stands_still_are_refused_as_long_as_it_does(scan_clock, time_increment):
    inputs = ScanInput(AssemblerConfig(scan_clock=scan_clock))
    reasons = []
    for k in range(60):
        message = scan(time_increment=time_increment)
        moves = k if k < 10 else max(10, k - 29)  # still for thirty scans
        message.header.stamp = time_message(START_NS + moves * 10**8)
        try:
            inputs.scan(message, START_NS + k * 10**8)
        except RefusedScanError as refusal:
            reasons.append((k, str(refusal)))
    still = [k for k, reason in reasons if reason == ScanInput.SAME_STAMP]
    assert still == list(range(11, 40))


def test_malformed_scans_of_another_frame_refuse_none():
    inputs = ScanInput(AssemblerConfig())
    for k in range(10):
        message = scan()
        message.header.frame_id = 'ab'[k % 2]
        message.header.stamp = time_message(1_700_000_000 * 10**9 + k * 10**8)
        if k % 2 == 0:
            message.range_max = float('nan')
            with pytest.raises(RefusedScanError, match='range_max'):
                inputs.scan(message, time_ns(message.header.stamp))
        else:
            inputs.scan(message, time_ns(message.header.stamp))


@pytest.mark.parametrize(('joints_too', 'restamped'), [(True, 0.0), (False, -4.97)])
def test_scans_of_a_recording_that_is_played_in_a_loop_have_not_moved_alone(joints_too, restamped):
    assembler = MessageAssembler(AssemblerConfig(joint_name='nod'), lambda: '')
    for k in range(100):
        arrived_ns = 1_700_000_000 * 10**9 + k * 10**8
        message = scan()
        message.header.stamp = time_message(arrived_ns - (4_970_000_000 if k >= 50 else 0))
        state = joint_state()
        state.header.stamp = message.header.stamp if joints_too else time_message(arrived_ns)
        list(assembler.add_joint_state(state))
        with suppress(RefusedScanError):
            assembler.scan(message, arrived_ns)
    assert assembler.timing.restamped == pytest.approx(restamped, abs=1e-6)


def test_a_single_position_that_is_not_of_the_motion_of_the_joint_is_counted():
    drops = Counter()
    joints, found = JointInput(AssemblerConfig(joint_name='nod'), drops), []
    for k in range(100):
        pitch = 0.3 if k == 50 else 0.01 * k
        state = joint_state(position=[9.0, pitch])
        state.header.stamp = time_message(START_NS + k * 10**7)
        found += [position for _, position in joints.samples(state)]
    assert found == [0.01 * k for k in range(100) if k != 50]
    assert drops == {JointInput.STRAY: 1}


def test_a_joint_is_at_one_position_at_a_time():
    drops = Counter()
    joints = JointInput(AssemblerConfig(joint_name='nod'), drops)
    found = [
        joints.samples(joint_state(1_700_000_000 + sec, position=[9.0, pitch]))
        for sec, pitch in ((0, 0.1), (0, 0.1), (0, 0.2), (1, 0.2))
    ]
    first, second = 1_700_000_000 * 10**9, 1_700_000_001 * 10**9
    assert found == [[(first, 0.1)], [(first, 0.1)], [], [(second, 0.2)]]
    assert drops == {JointInput.SAME_STAMP: 1}


@pytest.mark.parametrize('range_min', [0.0, -5.0])
@pytest.mark.parametrize('offset', [0.0, 0.05, -0.05])
def test_zero_and_huge_ranges_are_no_measurements_whatever_the_limits(range_min, offset):
    message = scan(range_min=range_min, range_max=INF, ranges=[0.0, 1.0, 1e30, INF, NAN])
    found = taken(message, range_offset=offset)
    measured = found.geometry.measured(found.ranges)
    assert measured.tolist() == [False, True, False, False, False]
    assert found.ranges[1] == pytest.approx(1.0 + offset)

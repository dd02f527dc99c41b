"""Wrong stamps and rates, and missing scans, found by the revolutions of the lidar."""

from nodlidar_assembler.inputs.scan_timing import ScanTiming
import numpy as np
import pytest

BEGIN_NS, T = 1_800_000_000_000_000_000, 0.1
MS, S = 1_000_000, 1_000_000_000


def stamps(count, begin=0):
    """Return stamps with 0.3 ms of jitter [ns]."""
    jitter = np.random.default_rng(1).uniform(-3e5, 3e5, begin + count)[begin:]
    return [BEGIN_NS + (begin + k) * 100 * MS + int(j) for k, j in enumerate(jitter)]


def watched(times_ns, nominal=T):
    timing = ScanTiming()
    return timing, [timing.refuse(t, nominal, t) for t in times_ns]


def test_scans_of_an_even_lidar_are_all_right():
    timing, reasons = watched(stamps(600))
    assert not any(reasons)
    assert timing.missing == 0


@pytest.mark.parametrize('off_ms', [-5_000, -53, -8, 8, 53])
def test_a_single_stamp_that_is_off_is_refused_and_no_other(off_ms):
    times_ns = stamps(100)
    times_ns[60] += off_ms * MS
    _, reasons = watched(times_ns)
    assert [k for k, reason in enumerate(reasons) if reason] == [60]
    assert reasons[60] == ScanTiming.WRONG_TIME


@pytest.mark.parametrize('seed', range(5))
def test_a_motor_whose_speed_wanders_is_believed(seed):
    rng = np.random.default_rng(seed)
    speed, periods = 0.0, []
    for _ in range(600):  # half a percent, corrected within some revolutions
        speed = 0.7 * speed + 0.7 * rng.normal(0.0, 0.5 * MS)
        periods.append(100 * MS + round(speed))
    times_ns = BEGIN_NS + np.cumsum(periods)
    assert np.abs(times_ns - BEGIN_NS - np.arange(1, 601) * 100 * MS).max() > 5 * MS
    times_ns[400] += 12 * MS
    timing = ScanTiming()
    stated = np.array(periods) / S
    reasons = [timing.refuse(int(t), n, int(t)) for t, n in zip(times_ns, stated, strict=True)]
    assert {k for k, reason in enumerate(reasons) if reason} <= {400}


def test_a_lidar_that_began_anew_is_believed_after_four_scans():
    times_ns = stamps(60) + [t + 30 * MS for t in stamps(60, 60)]
    _, reasons = watched(times_ns)
    assert [k for k, reason in enumerate(reasons) if reason] == [60, 61, 62, 63]


def test_after_a_silence_it_is_believed_at_once():
    timing, reasons = watched(stamps(60) + [t + 30 * MS for t in stamps(60, 90)])
    assert not any(reasons)
    assert timing.missing == 30


def test_another_time_is_believed_at_once():
    timing, reasons = watched(stamps(60) + [t - 3600 * S for t in stamps(60)])
    assert not any(reasons)
    assert timing.missing == 0


def test_where_stamps_scatter_none_is_refused():
    scattered = np.random.default_rng(2).uniform(-20e6, 20e6, 200).astype(int)
    _, reasons = watched([t + int(off) for t, off in zip(stamps(200), scattered, strict=True)])
    assert not any(reasons)


@pytest.mark.parametrize('nominal', [0.0, 1e-3, 1e-2, 1.0])
def test_ten_scans_of_an_absurd_rate_are_refused_and_change_nothing(nominal):
    timing, times_ns = ScanTiming(), stamps(100)
    reasons = [timing.refuse(t, nominal if 50 <= k < 60 else T, t) for k, t in enumerate(times_ns)]
    assert [k for k, reason in enumerate(reasons) if reason] == list(range(50, 60))
    assert timing.missing == 10


@pytest.mark.parametrize('nominal', [0.0, 1e-3, 1e-2, 1.0])
def test_after_an_absurd_beginning_the_right_rate_is_believed_within_two_seconds(nominal):
    timing, times_ns = ScanTiming(), stamps(100)
    reasons = [timing.refuse(t, nominal if k < 10 else T, t) for k, t in enumerate(times_ns)]
    assert reasons[30:] == [''] * 70


def test_missing_revolutions_are_counted_but_not_those_that_the_lidar_skips():
    timing, _ = watched([t for k, t in enumerate(stamps(100)) if k % 10 != 7])
    assert timing.missing == 10
    timing, _ = watched(stamps(100)[::3])
    assert timing.missing == 0


@pytest.mark.parametrize('step_ns', [-3600 * S, -25 * S, -30 * MS, 30 * MS, 3600 * S])
def test_with_a_clock_that_was_set_all_goes_on(step_ns):
    timing, times_ns = ScanTiming(), stamps(100)
    assert not any(timing.refuse(t, T, t) for t in times_ns[:50])
    timing.shift(step_ns)
    assert not any(timing.refuse(t + step_ns, T, t + step_ns) for t in times_ns[50:])
    assert timing.missing == 0


def test_where_no_scan_states_a_rate_none_is_refused():
    _, reasons = watched(stamps(60), 0.0)
    assert not any(reasons)


def test_scans_that_no_longer_state_a_rate_are_believed_after_two_seconds():
    timing = ScanTiming()
    reasons = [timing.refuse(t, T if k < 50 else 0.0, t) for k, t in enumerate(stamps(100))]
    assert [k for k, reason in enumerate(reasons) if reason] == list(range(50, 69))


@pytest.mark.parametrize('jump_ms', [-3600_000, -3600_053, 1500, 5053, 3600_000, 3600_053])
def test_after_a_single_stamp_of_another_time_wrong_ones_are_still_refused(jump_ms):
    times_ns = stamps(100)
    times_ns[60] += jump_ms * MS
    times_ns[63] += 53 * MS
    timing, reasons = watched(times_ns)
    assert [k for k, reason in enumerate(reasons) if reason] == [63]
    assert timing.missing <= 2  # those two


def late(count, moved_ns, moved_lidar_ns=0, seed=3):
    """Return stamps and arrivals 70 ms later, or up to 8 ms more; both change after 60 scans."""
    waits = np.random.default_rng(seed).uniform(0.0, 8e6, count).astype(int).tolist()
    begins = [t + (moved_lidar_ns if k >= 60 else 0) for k, t in enumerate(stamps(count))]
    arrivals = [t + 70 * MS + wait for t, wait in zip(begins, waits, strict=True)]
    return [t + (moved_ns if k >= 60 else 0) for k, t in enumerate(begins)], arrivals


WHOLE_AND_OTHER = [-800, -450, -300, -70, -30, -20, -8, 8, 20, 30, 70, 300, 450, 800]


@pytest.mark.parametrize('moved_ms', WHOLE_AND_OTHER)
def test_stamps_that_move_while_scans_come_as_before_are_told_until_they_are_as_before(moved_ms):
    timing = ScanTiming()
    for stamp_ns, arrived_ns in zip(*late(100, moved_ms * MS), strict=True):
        timing.refuse(stamp_ns, T, arrived_ns)
    assert timing.restamped == pytest.approx(moved_ms / 1e3, abs=4e-3)
    for stamp_ns, arrived_ns in list(zip(*late(200, 0), strict=True))[100:]:
        timing.refuse(stamp_ns, T, arrived_ns)
    assert timing.restamped == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize('moved_ms', WHOLE_AND_OTHER)
def test_stamps_that_are_right_again_after_a_silence_are_no_longer_told(moved_ms):
    timing = ScanTiming()
    moved, right = late(100, moved_ms * MS), late(200, 0, 33 * MS)
    for stamp_ns, arrived_ns in zip(*moved, strict=True):
        timing.refuse(stamp_ns, T, arrived_ns)
    assert timing.restamped == pytest.approx(moved_ms / 1e3, abs=4e-3)
    for stamp_ns, arrived_ns in list(zip(*right, strict=True))[120:]:
        timing.refuse(stamp_ns, T, arrived_ns)
    assert timing.restamped == 0.0


@pytest.mark.parametrize('ahead_ms', [5000, 953])
@pytest.mark.parametrize('from_start', [True, False])
def test_stamps_of_the_future_that_are_right_again_are_not_told(ahead_ms, from_start):
    timing = ScanTiming()
    for k, (stamp_ns, arrived_ns) in enumerate(zip(*late(200, 0), strict=True)):
        is_ahead = k < 100 and (from_start or k >= 50)
        timing.refuse(stamp_ns + is_ahead * ahead_ms * MS, T, arrived_ns)
        assert k < 120 or timing.restamped == 0.0


@pytest.mark.parametrize('moved_ms', WHOLE_AND_OTHER)
def test_stamps_that_move_are_told_where_every_seventh_scan_is_lost(moved_ms):
    timing = ScanTiming()
    for k, (stamp_ns, arrived_ns) in enumerate(zip(*late(100, moved_ms * MS), strict=True)):
        if k % 7:
            timing.refuse(stamp_ns, T, arrived_ns)
    assert timing.restamped == pytest.approx(moved_ms / 1e3, abs=4e-3)


@pytest.mark.parametrize('moved_ms', WHOLE_AND_OTHER)
def test_stamps_that_are_trusted_are_not_told_until_they_move_again(moved_ms):
    timing = ScanTiming()
    for stamp_ns, arrived_ns in zip(*late(100, moved_ms * MS), strict=True):
        timing.refuse(stamp_ns, T, arrived_ns)
    timing.trust_stamps()
    for stamp_ns, arrived_ns in list(zip(*late(140, moved_ms * MS), strict=True))[100:]:
        timing.refuse(stamp_ns, T, arrived_ns)
        assert timing.restamped == 0.0
    for stamp_ns, arrived_ns in list(zip(*late(200, 0), strict=True))[140:]:
        timing.refuse(stamp_ns, T, arrived_ns)
    assert timing.restamped == pytest.approx(-moved_ms / 1e3, abs=4e-3)


@pytest.mark.parametrize('late_ms', [50, 100, 300])
@pytest.mark.parametrize('seed', range(10))
def test_a_line_that_is_late_for_a_while_moves_no_stamps(late_ms, seed):
    """Of a motor whose speed wanders, so that new lines begin meanwhile and after."""
    rng, timing = np.random.default_rng(seed), ScanTiming()
    speed, stamp_ns = 0.0, BEGIN_NS
    for k in range(400):
        speed = 0.7 * speed + rng.normal(0.0, 0.5 * MS)
        stamp_ns += 100 * MS + round(speed)
        arrived_ns = stamp_ns + (70 + late_ms * (120 <= k < 160)) * MS
        timing.refuse(stamp_ns, 0.1 + speed / S, arrived_ns)
        assert timing.restamped == 0.0


@pytest.mark.parametrize('lost', range(5))
def test_a_queue_that_is_emptied_moves_no_stamps(lost):
    """Scans are 300 ms late for 4 s; then some are lost, and the others are in time."""
    timing = ScanTiming()
    for k, stamp_ns in enumerate(stamps(300)):
        if not 100 <= k < 100 + lost:
            timing.refuse(stamp_ns, T, stamp_ns + (370 if 60 <= k < 100 else 70) * MS)
        assert timing.restamped == 0.0


def test_when_joint_states_went_back_as_well_stamps_have_not_moved_alone():
    """As where a recording is played in a loop."""
    timing = ScanTiming()
    for k, (stamp_ns, arrived_ns) in enumerate(zip(*late(100, -5030 * MS), strict=True)):
        if k == 61:
            timing.joints_went_back()
        timing.refuse(stamp_ns, T, arrived_ns)
    assert timing.restamped == 0.0


@pytest.mark.parametrize('moved_ms', [-30, 30])
def test_a_lidar_that_began_anew_has_not_moved_its_stamps(moved_ms):
    for seed in range(20):
        timing = ScanTiming()
        for stamp_ns, arrived_ns in zip(*late(100, 0, moved_ms * MS, seed), strict=True):
            timing.refuse(stamp_ns, T, arrived_ns)
        assert timing.restamped == 0.0

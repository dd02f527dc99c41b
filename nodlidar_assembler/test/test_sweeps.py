"""Reversals and the clouds that they separate, against the commanded triangle."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.point_layout import POINT
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.clouds.reversals import ReversalFinder
from nodlidar_assembler.clouds.sweeps import SweepGatherer
from nodlidar_common.nod import Nod
import numpy as np

TICK = np.radians(300.0) / 1024
START_NS = 1_700_000_000_000_000_000


def nod(samples_per_sweep=4001):
    return Nod(-0.6136, 0.6136, samples_per_sweep * 0.1 / 1024, samples_per_sweep, START_NS)


def reversals_of(times_ns, pitch):
    finder = ReversalFinder()
    found = (finder.add(int(t), float(p)) for t, p in zip(times_ns, pitch, strict=True))
    return [reversal for reversal in found if reversal is not None]


def samples(rate, duration, phase=0.0):
    times_ns = START_NS + ((np.arange(duration * rate) + phase) / rate * 1e9).astype(np.int64)
    return times_ns, np.rint(nod().pitch(times_ns) / TICK) * TICK


@given(st.sampled_from([40.0, 62.0, 100.0, 200.0]), st.floats(0.0, 1.0))
def test_every_reversal_is_found_once_within_two_milliseconds(rate, phase):
    times_ns, pitch = samples(rate, 8, phase)
    reversals = np.array(reversals_of(times_ns, pitch))
    sweeps = nod().sweeps(reversals)
    nearest = np.rint(sweeps)
    assert nearest.tolist() == list(range(int(nearest[0]), int(nearest[0]) + len(reversals)))
    assert len(reversals) >= 8 / nod().sweep_duration - 3
    assert np.max(np.abs(sweeps - nearest)) * nod().sweep_duration < 2e-3


def test_a_resting_nod_has_no_reversal():
    times_ns = START_NS + np.arange(1000) * 10_000_000
    wobble = TICK * (np.arange(1000) % 2)
    assert reversals_of(times_ns, wobble) == []


def test_samples_out_of_order_are_left_out():
    times_ns, pitch = samples(100.0, 4)
    shuffled = np.insert(times_ns, 50, times_ns[20]), np.insert(pitch, 50, pitch[20])
    assert reversals_of(*shuffled) == reversals_of(times_ns, pitch)


def scan_of(start_ns, beams=100):
    """Return points that are 1 ms apart."""
    data = np.zeros(beams, dtype=POINT)
    data['time'] = np.arange(beams) * 1e-3
    data['x'] = (start_ns - START_NS) // 1_000_000 + np.arange(beams)
    return Points(start_ns + np.arange(beams) * 1_000_000, data)


@given(st.lists(st.integers(1, 999), unique=True, max_size=6), st.integers(0, 3))
def test_clouds_are_cut_at_the_reversals_even_inside_a_scan_and_lose_nothing(
    reversals_ms, lateness
):
    """Ten scans of 100 points, 1 ms apart; reversals become known some scans late."""
    reversals_ms = sorted(reversals_ms)
    gatherer = SweepGatherer(max_duration=30.0)
    clouds = []
    for k in range(10 + lateness):
        for reversal in reversals_ms:
            if reversal // 100 + lateness == k:
                gatherer.add_reversal(START_NS + reversal * 1_000_000)
        if k < 10:
            clouds += gatherer.add_scan(scan_of(START_NS + k * 100_000_000))
    # One more scan, after the last reversal, releases what is still held.
    clouds += gatherer.add_scan(scan_of(START_NS + 1_000_000_000))
    assert len(clouds) == len(reversals_ms)
    begin = 0
    for cloud, end in zip(clouds, reversals_ms, strict=True):
        assert cloud.data['x'].tolist() == list(range(begin, end))
        assert cloud.time_ns[0] == START_NS + begin * 1_000_000
        np.testing.assert_allclose(cloud.data['time'], np.arange(end - begin) * 1e-3, atol=1e-6)
        assert np.all(np.diff(cloud.data['time']) > 0)
        assert np.all(np.diff(cloud.data['ring'].astype(int)) >= 0)
        begin = end


@given(st.lists(st.integers(1, 999), unique=True, max_size=9), st.integers(1, 4))
def test_several_sweeps_make_one_cloud_and_nothing_is_lost(reversals_ms, sweeps):
    reversals_ms = sorted(reversals_ms)
    gatherer = SweepGatherer(max_duration=30.0, sweeps=sweeps)
    for reversal in reversals_ms:
        gatherer.add_reversal(START_NS + reversal * 1_000_000)
    scans = [scan_of(START_NS + k * 100_000_000) for k in range(11)]
    clouds = [cloud for scan in scans for cloud in gatherer.add_scan(scan)]
    ends = reversals_ms[sweeps - 1 :: sweeps]
    assert [int(cloud.data['x'][-1]) + 1 for cloud in clouds] == ends
    values = [x for cloud in clouds for x in cloud.data['x'].tolist()]
    assert values == list(range(ends[-1] if ends else 0))


def test_a_nod_that_stands_still_does_not_gather_without_end():
    gatherer = SweepGatherer(max_duration=1.0)
    clouds = [
        c for k in range(100) for c in gatherer.add_scan(scan_of(START_NS + k * 100_000_000))
    ]
    assert len(clouds) == 9
    assert all(len(cloud.data) == 1000 for cloud in clouds)


@given(st.sampled_from([1, 2]), st.sampled_from([(800, 800), (1200, 400)]))
def test_while_the_nod_rests_clouds_end_after_twice_the_usual_time(sweeps, durations_ms):
    """Six sweeps, of which every second one may be a fast return; 20 s of rest; the same again."""
    gatherer, clouds = SweepGatherer(30.0, sweeps), []
    ends_ms = np.cumsum([*durations_ms * 3, 20_000, *durations_ms * 3])
    for k in range(int(ends_ms[-1]) // 100 + 1):
        for end_ms in ends_ms[ends_ms // 100 == k]:
            gatherer.add_reversal(START_NS + int(end_ms) * 1_000_000)
        clouds += gatherer.add_scan(scan_of(START_NS + k * 100_000_000))
    longest_ns = 2 * max(durations_ms[0], sum(durations_ms[:sweeps])) * 1_000_000
    assert max(cloud.time_ns[-1] - cloud.time_ns[0] for cloud in clouds) <= longest_ns
    assert len(clouds) >= 20_000_000_000 // longest_ns
    values = [x for cloud in clouds for x in cloud.data['x'].tolist()]
    assert values == list(range(len(values)))


@given(st.sampled_from([1, 2]), st.integers(1500, 9000))
def test_a_nod_that_is_commanded_to_be_slower_does_not_rest(sweeps, slower_ms):
    gatherer, clouds = SweepGatherer(30.0, sweeps), []
    ends_ms = np.cumsum([700] * 8 + [slower_ms] * 4 * sweeps)
    for k in range(int(ends_ms[-1]) // 100 + 1):
        gatherer.commanded_ns = (700 if 100 * k < 5600 else slower_ms) * 1_000_000
        for end_ms in ends_ms[ends_ms // 100 == k]:
            gatherer.add_reversal(START_NS + int(end_ms) * 1_000_000)
        clouds += gatherer.add_scan(scan_of(START_NS + k * 100_000_000))
    assert len(clouds) == len(ends_ms) // sweeps


def test_reversals_are_found_again_when_time_goes_back():
    times_ns, pitch = samples(100.0, 4)
    once = reversals_of(times_ns, pitch)
    assert reversals_of(np.tile(times_ns, 2), np.tile(pitch, 2)) == once * 2


def test_when_time_goes_back_the_cloud_so_far_is_closed():
    gatherer = SweepGatherer(max_duration=30.0)
    assert gatherer.add_scan(scan_of(START_NS)) == []
    gatherer.add_reversal(START_NS + 150_000_000)
    (cloud,) = gatherer.add_scan(scan_of(START_NS - 10_000_000_000))
    assert cloud.time_ns[0] == START_NS
    assert len(cloud.data) == 100


def test_scans_that_overlap_a_little_are_of_one_cloud():
    """As of drivers that stamp a scan when it has come; here its last three beams overlap."""
    gatherer = SweepGatherer(max_duration=30.0)
    gatherer.add_reversal(START_NS + 450_500_000)
    scans = [scan_of(START_NS + k * 100_000_000, beams=103) for k in range(6)]
    (cloud,) = (cloud for scan in scans for cloud in gatherer.add_scan(scan))
    assert len(cloud.data) == 4 * 103 + 51
    assert cloud.data['ring'].max() == 4
    assert (np.diff(cloud.time_ns) >= 0).all()
    np.testing.assert_allclose(cloud.data['time'] * 1e9, cloud.time_ns - START_NS, atol=100.0)
    np.testing.assert_array_equal(np.bincount(cloud.data['ring']), [103] * 4 + [51])


def test_a_scan_that_arrives_twice_is_in_its_cloud_once():
    gatherer, clouds = SweepGatherer(max_duration=30.0), []
    for k in (0, 1, 1, 2, 2):
        clouds += gatherer.add_scan(scan_of(START_NS + k * 100_000_000))
    gatherer.add_reversal(START_NS + 300_000_000)
    clouds += gatherer.add_scan(scan_of(START_NS + 300_000_000))
    assert [cloud.data['ring'].max() for cloud in clouds] == [2]
    assert np.diff(clouds[0].time_ns).min() > 0

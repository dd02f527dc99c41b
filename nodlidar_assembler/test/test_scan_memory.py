"""The points of an interval, against the list of all points; what is refused."""

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds import scan_memory
from nodlidar_assembler.clouds.deskew import deskewed
from nodlidar_assembler.clouds.ego_motion import Poses
from nodlidar_assembler.clouds.point_layout import DESKEWED_POINT, POINT
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.clouds.scan_memory import ScanMemory
from nodlidar_common.errors import ParameterError
import numpy as np
import pytest

S = 1_000_000_000
BEGIN_NS = 1_700_000_000 * S


def scan_at(times_ns, point=POINT, poses=None):
    """Return a scan whose points have their instant, since BEGIN_NS, as x."""
    times_ns = np.array(times_ns, dtype=np.int64)
    data = np.zeros(len(times_ns), dtype=point)
    data['x'] = (times_ns - BEGIN_NS) / S
    return Points(times_ns, data, poses=poses)


def scans_of(gaps, beams):
    """Return scans of so many beams, 0.1 s apart, each after a gap [s]."""
    scans, time_ns = [], BEGIN_NS
    for gap, count in zip(gaps, beams, strict=True):
        time_ns += round(gap * S)
        scans.append(scan_at([time_ns + k * S // 10 for k in range(count)]))
        time_ns += count * S // 10
    return scans


scans_drawn = st.lists(
    st.tuples(st.integers(0, 30).map(lambda n: n / 10), st.integers(0, 4)), min_size=1, max_size=12
).map(lambda drawn: scans_of(*zip(*drawn, strict=True)))
instants = st.integers(-20, 400).map(lambda n: BEGIN_NS + n * S // 20)


@given(scans_drawn, instants, instants, st.integers(1, 40))
def test_the_points_of_an_interval_are_there_or_it_says_that_they_are_not(scans, begin, end, kept):
    memory = ScanMemory(kept / 10)
    for scan in scans:
        memory.add(scan)
    times = [int(t) for scan in scans for t in scan.time_ns]
    inside = [t for t in times if begin <= t <= end]
    # A whole scan goes as soon as its last point is too old.
    ends = [int(scan.time_ns[-1]) for scan in scans if len(scan.time_ns)]
    gone = any(begin <= t < times[-1] - kept * S // 10 for t in ends)
    if end < begin or gone:
        with pytest.raises(ParameterError) as caught:
            memory.between(begin, end)
        assert caught.value.key == ('end' if end < begin else 'begin')
        return
    cloud = memory.between(begin, end)
    assert ([] if cloud is None else cloud.time_ns.tolist()) == inside
    if cloud is not None:
        np.testing.assert_allclose(cloud.data['x'], (np.array(inside) - BEGIN_NS) / S, rtol=1e-6)
        np.testing.assert_allclose(
            cloud.data['time'], (np.array(inside) - inside[0]) / S, atol=1e-6
        )


@given(scans_drawn)
def test_zero_is_all_that_is_kept(scans):
    memory = ScanMemory(1.0)
    for scan in scans:
        memory.add(scan)
    times = [int(t) for scan in scans for t in scan.time_ns]
    cloud = memory.between(0, 0)
    assert (cloud is None) == (not times)
    if cloud is not None:
        kept = cloud.time_ns.tolist()
        assert kept == times[-len(kept) :]
        assert {t for t in times if t >= times[-1] - S} <= set(kept)


def test_memory_has_an_end_for_dense_scans_too(monkeypatch):
    monkeypatch.setattr(scan_memory, 'MOST_POINTS', 1000)
    monkeypatch.setattr(scan_memory, 'MOST_SCANS', 50)
    for beams, most in ((100, 10), (1, 50)):
        memory = ScanMemory(600.0)
        for k in range(200):
            memory.add(scan_at([BEGIN_NS + k * S // 10 + beam for beam in range(beams)]))
        cloud = memory.between(0, 0)
        assert (cloud.data['ring'][-1] + 1, len(cloud.data)) == (most, most * beams)
        with pytest.raises(ParameterError, match='not kept'):
            memory.between(BEGIN_NS, 0)


def test_scans_that_come_twice_are_kept_once_and_time_may_begin_anew():
    memory = ScanMemory(60.0)
    first, second = (scan_at([BEGIN_NS + k * S // 5, BEGIN_NS + k * S // 5 + 1]) for k in (0, 1))
    for scan in (first, second, first, second):
        memory.add(scan)
    assert len(memory.between(0, 0).data) == 4
    memory.add(scan_at([BEGIN_NS - 2 * S]))
    assert memory.between(BEGIN_NS - 3 * S, 0).time_ns.tolist() == [BEGIN_NS - 2 * S]


def test_points_of_two_frames_are_never_in_one_cloud():
    memory = ScanMemory(60.0)
    memory.add(scan_at([BEGIN_NS]), in_odometry=True)
    memory.add(scan_at([BEGIN_NS + S]), in_odometry=False)
    assert memory.between(BEGIN_NS + 1, 0).time_ns.tolist() == [BEGIN_NS + S]
    assert not memory.in_odometry
    with pytest.raises(ParameterError, match="'begin' must be after 1700000000"):
        memory.between(BEGIN_NS, 0)


def test_points_with_poses_are_deskewed_as_those_of_a_sweep():
    """A robot that moves 1 m between two points of x = 0 and 1: the first is 1 m behind."""
    times = [BEGIN_NS, BEGIN_NS + S]
    poses = Poses(np.array([[0.0, 0, 0], [1.0, 0, 0]]), np.tile([0.0, 0, 0, 1.0], (2, 1)))
    whole = scan_at(times, DESKEWED_POINT, poses)
    memory = ScanMemory(60.0)
    for part in (whole[:1], whole[1:]):
        memory.add(part)
    cloud = memory.between(0, 0)
    assert cloud.stamp_ns == times[-1]
    np.testing.assert_array_equal(cloud.data['x'], [-1.0, 1.0])
    np.testing.assert_array_equal(cloud.data['x'], deskewed(whole).data['x'])


def test_points_from_before_a_jump_of_odometry_are_forgotten():
    memory = ScanMemory(60.0)
    memory.add(scan_at([BEGIN_NS]), in_odometry=True)
    memory.add(scan_at([BEGIN_NS + S]), in_odometry=True, jumped=True)
    memory.add(scan_at([BEGIN_NS + 2 * S]), in_odometry=True)
    assert memory.between(0, 0).time_ns.tolist() == [BEGIN_NS + S, BEGIN_NS + 2 * S]


def test_a_jump_of_odometry_counts_if_its_scan_has_no_point():
    memory = ScanMemory(60.0)
    memory.add(scan_at([BEGIN_NS]), in_odometry=True)
    memory.add(scan_at([]), in_odometry=True, jumped=True)
    memory.add(scan_at([BEGIN_NS + 2 * S]), in_odometry=True)
    assert memory.between(0, 0).time_ns.tolist() == [BEGIN_NS + 2 * S]
    assert memory.forgotten_ns == BEGIN_NS

"""The short form of the regressions: counts, and ratios of times within this run."""

import pytest

from bench.cost.hot_paths import comparison, IN_YARDSTICKS, results, SIZE, VERDICT, WHAT

BEAMS, POINT_STEP = 682, 24
# No point is twice as far as these in any run on a quiet machine; a loop over beams would be.
AT_MOST = [
    ('scan to points, ends', 2.5, 'scan to points, nearest'),
    ('scan to points, slerp', 3.0, 'scan to points, nearest'),
    ('scan to points, slerp, per-beam odometry', 8.0, 'scan to points, slerp'),
    ('scan to points, trajectory', 40.0, 'scan to points, slerp'),
    ('points to message', 1.0, 'scan to points, nearest'),
    ('coverage of a scan', 15.0, 'scan to points, nearest'),
    ('decoding the 682 ranges of a scan', 2.0, 'scan to points, nearest'),
]


@pytest.fixture(scope='module')
def measured():
    return {row[WHAT]: row for row in results(rounds=9)}


@pytest.mark.parametrize(('what', 'times', 'other'), AT_MOST)
def test_a_path_takes_at_most_so_many_times_as_long_as_another(measured, what, times, other):
    assert measured[what][IN_YARDSTICKS] <= times * measured[other][IN_YARDSTICKS]


def test_every_beam_that_measured_something_is_a_point(measured):
    """In the room, every beam of these scans meets a wall within the lidar's range."""
    paths = [row for what, row in measured.items() if what.startswith('scan to points')]
    assert [row[SIZE] for row in paths] == [BEAMS] * 5
    assert measured['points to message'][SIZE] == BEAMS * POINT_STEP


def test_what_got_slower_than_before_is_named():
    before = [{WHAT: name, IN_YARDSTICKS: 2.0} for name in ('same', 'slower', 'faster', 'gone')]
    now = [('same', 2.2), ('slower', 2.6), ('faster', 0.5), ('new', 9.0)]
    rows = comparison([{WHAT: name, IN_YARDSTICKS: time} for name, time in now], before)
    assert [(row[WHAT], row['ratio'], row[VERDICT]) for row in rows] == [
        ('same', pytest.approx(1.1), ''),
        ('slower', pytest.approx(1.3), 'slower'),
        ('faster', pytest.approx(0.25), ''),
    ]

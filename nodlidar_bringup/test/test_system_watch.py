"""What doctor makes of the messages that it heard."""

from nodlidar_bringup.ros.system_watch import seen, watched
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan

END_NS = 1_700_000_000_000_000_000


@pytest.mark.parametrize(
    ('before_end', 'seconds'),
    [([], 4.0), ([0.05], 2.0), ([0.15, 0.05], 2.0), ([3.0, 2.9, 0.1], 3.0), ([4.5], 4.5)],
)
def test_a_topic_counts_as_watched_from_its_first_message_if_that_came_early(before_end, seconds):
    arrivals = [END_NS - round(each * 1e9) for each in before_end]
    assert watched(arrivals, END_NS, 4.0) == pytest.approx(seconds, abs=1e-6)


def test_beams_are_seen_if_their_range_is_one():
    """A covered lidar: of YDLIDAR's driver lost beams are 0, of others NaN or infinite."""
    ranges = [0.0, 0.04, 0.05, 3.0, 12.0, 12.1, np.nan, np.inf, -np.inf]
    scan = LaserScan(ranges=ranges, range_min=0.05, range_max=12.0)
    assert seen(scan).tolist() == [False] * 2 + [True] * 3 + [False] * 4

"""The way of a scan to its cloud in virtual time: when what it waits for never comes."""

from log_messages import scan_message, state_message
from message_filters import SimpleFilter
from node_bench import sensor_log, simulated, START_NS
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.filters.scan_to_cloud import ScanToCloud
from nodlidar_sim.world.scene import load_scene
import pytest

DEADLINE = 0.05
NO_ODOMETRY = 'no odometry after it before the deadline'
SCAN, STATE = range(2)


class Silence:
    """Odometry that never comes."""

    trouble = ''

    def __init__(self):
        self.history = OdometryHistory()

    def register(self, on_sample, on_time_back):
        """Keep nothing: neither will ever be called."""


class Way:
    """A ScanToCloud without odometry, its clock, and what came of the scans."""

    def __init__(self, **config):
        self.now_ns, self.made = START_NS, []
        self._inputs = SimpleFilter(), SimpleFilter()
        self._way = ScanToCloud(
            AssemblerConfig(ego_motion='beam', deadline=DEADLINE, **config),
            *self._inputs,
            Silence(),
            lambda: self.now_ns,
            lambda scan, clouds, odometry: self.made.append(scan.stamp_ns),
        )
        self.drops = self._way.drops

    def feed(self, at_ns, kind, message):
        self.now_ns = at_ns
        self._inputs[kind].signalMessage(message)


@pytest.fixture(scope='module')
def messages():
    """Return half a second of scans and joint states, each with the time at which it comes."""
    log = sensor_log(simulated(load_scene('wall'), 0.5))
    timed = [(s.stamp_ns + 66_600_000, SCAN, scan_message(s)) for s in log.scans]
    samples = zip(log.sample_ns.tolist(), log.sample_pitch, strict=True)
    timed += [(stamp_ns, STATE, state_message(stamp_ns, pitch)) for stamp_ns, pitch in samples]
    return sorted(timed, key=lambda entry: entry[0])


def test_a_scan_without_odometry_is_given_up_with_the_first_joint_state_after_the_deadline(
    messages,
):
    way = Way()
    given_up = []
    for entry in messages:
        before = way.drops[NO_ODOMETRY]
        way.feed(*entry)
        given_up += [way.now_ns] * (way.drops[NO_ODOMETRY] - before)
    arrivals = [at_ns for at_ns, kind, _ in messages if kind == SCAN]
    states = [at_ns for at_ns, kind, _ in messages if kind == STATE]
    assert len(given_up) >= 3
    for arrival_ns, at_ns in zip(arrivals, given_up, strict=False):
        bracketed_ns = next(ns for ns in states if ns >= arrival_ns)
        due_ns = bracketed_ns + round(DEADLINE * 1e9)
        assert at_ns == min(ns for ns in states + arrivals if ns > due_ns)


def test_it_leaves_uncompensated_as_soon_if_so_told(messages):
    dropping, way = Way(), Way(without_odometry='uncompensated')
    for entry in messages:
        dropping.feed(*entry)
        way.feed(*entry)
        assert len(way.made) == dropping.drops[NO_ODOMETRY]
    assert len(way.made) >= 3

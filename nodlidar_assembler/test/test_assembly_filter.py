"""The assembly as a filter, in virtual time: when what it waits for never comes."""

from log_messages import scan_message, state_message
from message_filters import SimpleFilter
from node_bench import sensor_log, simulated, START_NS
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ros.assembly_filter import AssemblyFilter
from nodlidar_common.publishers import Publishers
from nodlidar_common.stamps import time_ns
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

DEADLINE = 0.05
NO_ODOMETRY = 'no odometry after it before the deadline'
WARNING = f'scan dropped: {NO_ODOMETRY} (TF: no transform was heard)'
SCAN, STATE = range(2)


class VirtualClockWatch:
    """A clock that nobody sets."""

    def __init__(self):
        self.at_ns = START_NS

    def deadline_clock_ns(self):
        return self.at_ns

    now_ns = deadline_clock_ns

    def arrival_ns(self, received_ns):
        return received_ns or self.at_ns

    def check(self, kind, stamp_ns, arrived_ns=0):
        return True


class Scans(SimpleFilter):
    """Scans, whose arrival may be known."""

    arrived_ns = 0


class States(SimpleFilter):
    """Joint states that come one by one: none ever waits."""

    arrived_ns = 0
    publishers, publisher = Publishers(), 0

    def take(self):
        pass


class Bench:
    """An AssemblyFilter whose odometry never comes, its clock, and what came of the scans."""

    def __init__(self, **config):
        self.clock, self.made, self.warnings = VirtualClockWatch(), [], []
        self.inputs = Scans(), States()
        self.filter = AssemblyFilter(
            *self.inputs,
            AssemblerConfig(ego_motion='beam', deadline=DEADLINE, **config),
            self.clock,
            self.warnings.append,
            lambda: 'no transform was heard',
        )
        self.filter.registerCallback(self._note)
        self.drops = self.filter.assembler.drops

    def _note(self, outcome):
        if outcome.assembled is not None:
            self.made.append(outcome.scan.stamp_ns)

    def feed(self, at_ns, kind, message):
        self.clock.at_ns = at_ns
        self.inputs[kind].signalMessage(message)


@pytest.fixture(scope='module')
def messages():
    """Return half a second of scans and joint states, each with the time at which it comes."""
    log = sensor_log(simulated(load_scene('wall', ideal=True), 0.5))
    timed = [(s.stamp_ns + 66_600_000, SCAN, scan_message(s)) for s in log.scans]
    samples = zip(log.sample_ns.tolist(), log.sample_pitch, strict=True)
    timed += [(stamp_ns, STATE, state_message(stamp_ns, pitch)) for stamp_ns, pitch in samples]
    return sorted(timed, key=lambda entry: entry[0])


def test_a_scan_without_odometry_is_given_up_with_the_first_joint_state_after_the_deadline(
    messages,
):
    bench = Bench()
    given_up = []
    for entry in messages:
        before = bench.drops[NO_ODOMETRY]
        bench.feed(*entry)
        given_up += [bench.clock.at_ns] * (bench.drops[NO_ODOMETRY] - before)
    arrivals = [at_ns for at_ns, kind, _ in messages if kind == SCAN]
    states = [at_ns for at_ns, kind, _ in messages if kind == STATE]
    assert len(given_up) >= 3
    assert bench.warnings == [WARNING] * len(given_up)
    for arrival_ns, at_ns in zip(arrivals, given_up, strict=False):
        bracketed_ns = next(ns for ns in states if ns >= arrival_ns)
        due_ns = bracketed_ns + round(DEADLINE * 1e9)
        assert at_ns == min(ns for ns in states + arrivals if ns > due_ns)


def odometry(begin_ns, end_ns):
    """Return poses of a robot that stands still, every 20 ms."""
    return [
        (stamp_ns, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        for stamp_ns in range(begin_ns, end_ns, 20_000_000)
    ]


@pytest.mark.parametrize('goes_back', [False, True])
def test_odometry_taken_after_the_deadline_places_a_scan_all_the_same(messages, goes_back):
    bench, before = Bench(), [entry for entry in messages if entry[0] < START_NS + 90_000_000]
    for entry in before:
        bench.feed(*entry)
    bench.clock.at_ns += round(2 * DEADLINE * 1e9)
    for pose in odometry(START_NS, bench.clock.at_ns):
        bench.filter.add_odometry(*pose)
    if goes_back:
        bench.filter.odometry_went_back()
    bench.filter.release()
    (arrived,) = [message for _, kind, message in before if kind == SCAN]
    assert bench.made == [time_ns(arrived.header.stamp)]
    assert not bench.drops


def test_it_leaves_uncompensated_as_soon_if_so_told(messages):
    dropping, bench = Bench(), Bench(without_odometry='uncompensated')
    for entry in messages:
        dropping.feed(*entry)
        bench.feed(*entry)
        assert len(bench.made) == dropping.drops[NO_ODOMETRY]
    assert len(bench.made) >= 3


def test_scans_that_waited_are_dated_by_when_they_arrived_not_by_when_they_are_had(messages):
    """The node is busy for 30 s; an own clock of the lidar is told by arrivals."""
    bench, stamps_ns = Bench(scan_clock='device'), []
    bench.filter.scans.registerCallback(lambda scan: stamps_ns.append(scan.stamp_ns))
    scans = [entry for entry in messages if entry[1] == SCAN]
    for arrived_ns, kind, message in scans:
        bench.inputs[SCAN].arrived_ns = arrived_ns
        bench.feed(START_NS + 30 * 10**9, kind, message)
    expected = [time_ns(message.header.stamp) for _, _, message in scans]
    np.testing.assert_allclose(np.subtract(stamps_ns, expected), 0, atol=1_000_000)

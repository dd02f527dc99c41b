"""The assembler when the host's clock is set, in virtual time."""

from contextlib import contextmanager
from dataclasses import replace
from functools import cache

from log_messages import scan_message, state_message
from message_fuzz import fed
from node_bench import SCAN_NS, sensor_log, simulated
from nodlidar_assembler.ros import clock_watch, nod_publisher
from nodlidar_common.host_time import HostTime
from nodlidar_common.ros.diagnostics import CHECK_PERIOD
from nodlidar_common.ros.messages import nod_from_message
from nodlidar_common.ros.point_cloud import coordinates
from nodlidar_common.stamps import time_ns
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
from rclpy.time import Time

S, MS = 1_000_000_000, 1_000_000
DURATION, STEP_AT = 5.0, 2.537
CHECK_NS = round(CHECK_PERIOD * S)


class Clock:
    """The node's clock: the simulated time and a step."""

    ros_time_is_active = False

    def __init__(self):
        self.now_ns = self.step_ns = 0

    def now(self):
        return Time(nanoseconds=self.now_ns + self.step_ns)


@pytest.fixture(scope='module')
def log():
    """Return what the reference sensor tells in the scene 'wall'."""
    return sensor_log(simulated(load_scene('wall', ideal=True), DURATION))


def timed(log):
    """Return when each message comes, when it was stamped, its kind and how to make it."""
    scans = [(s.stamp_ns + SCAN_NS, 'scan', s.stamp_ns, s) for s in log.scans]
    samples = zip(log.sample_ns.tolist(), log.sample_pitch, strict=True)
    states = [(t + 2 * MS, 'joint', t, pitch) for t, pitch in samples]
    return sorted([*scans, *states], key=lambda entry: entry[0])


@contextmanager
def steady_by(clock):
    """Make the steady clock of the node that of the simulated time."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (clock_watch, nod_publisher):
            patch.setattr(module, 'steady_ns', lambda: clock.now_ns)
        yield


@pytest.fixture(scope='module')
def run(log):
    @cache
    def run(step_ns, *parameters, offset_ns=0, of='common'):
        """Return clouds and commands, each with when it came, and the node; the clock is set.

        The clock is 'common' to the devices and the assembler, or they have one each and that of
        the 'assembler', which is ahead by an offset, or that of the 'robot' is set.
        """
        clock, clouds, commands = Clock(), [], []
        with steady_by(clock), fed(*parameters) as running:
            node = running.node
            watch = node._clock_watch
            watch._clock = clock
            watch._time = HostTime(watch.now_ns, lambda: clock.now_ns)
            node._clouds.publish = lambda cloud: clouds.append((clock.now_ns, cloud))
            node._nod._commands.publish = lambda command: commands.append((clock.now_ns, command))
            waiting = []  # joint states, in the middleware
            node.states.take = lambda: [running.feed(*waiting.pop(0)) for _ in range(len(waiting))]
            checked_ns = begin_ns = log.scans[0].stamp_ns
            for arrival_ns, kind, stamp_ns, content in timed(log):
                clock.now_ns = arrival_ns
                is_set = arrival_ns - begin_ns >= STEP_AT * S
                step = step_ns if is_set else 0
                clock.step_ns = offset_ns + (step if of != 'robot' else 0)
                # A device's stamp is made of the clock when it is sent.
                stamp_ns += step if of != 'assembler' else 0
                if kind == 'scan':
                    running.feed(kind, scan_message(replace(content, stamp_ns=stamp_ns)))
                    continue
                message = state_message(stamp_ns, content)
                waiting.append((kind, message, clock.now().nanoseconds))
                if node.assembly.assembler.is_waiting or arrival_ns - checked_ns > CHECK_NS:
                    node.states.take()
                    checked_ns = arrival_ns
            assert node.survival.errors == {}
            return (
                clouds,
                commands,
                node.assembly.assembler.drops.copy(),
                dict(node.diagnosis.counts),
            )

    return run


def dropped_scans(clouds, drops, begin_ns):
    """Return how many scans were dropped; clouds go on within a second after the step."""
    after = [came_ns for came_ns, _ in clouds if came_ns - begin_ns >= STEP_AT * S]
    assert after[0] - begin_ns <= (STEP_AT + 1.0) * S
    return sum(n for reason, n in drops.items() if not reason.startswith('joint state '))


STEPS = [-3600 * S, -25 * S, -300 * MS, -40 * MS, 50 * MS, 3 * S, 3600 * S]


@pytest.mark.parametrize('step_ns', STEPS)
def test_clouds_are_those_of_an_even_clock_and_soon_go_on(run, log, step_ns):
    right, _, _, _ = run(0)
    clouds, _, drops, _ = run(step_ns)
    begin_ns = log.scans[0].stamp_ns
    by_stamp = {time_ns(cloud.header.stamp): cloud for _, cloud in right}
    for came_ns, cloud in clouds:
        is_set = came_ns - begin_ns >= STEP_AT * S
        even = by_stamp[time_ns(cloud.header.stamp) - (step_ns if is_set else 0)]
        np.testing.assert_allclose(coordinates(cloud), coordinates(even), atol=1e-6)
    assert len(clouds) + dropped_scans(clouds, drops, begin_ns) == len(right)
    assert drops['scan within 0.5 s after the clock was set'] == 5


@pytest.mark.parametrize('step_ns', STEPS)
def test_the_nod_goes_on_at_once_by_the_new_time(run, log, step_ns):
    _, commands, _, _ = run(step_ns)
    set_ns = log.scans[0].stamp_ns + round(STEP_AT * S)
    before = [nod_from_message(command) for came_ns, command in commands if came_ns < set_ns]
    came_ns, first = next(entry for entry in commands if entry[0] >= set_ns)
    assert came_ns - set_ns < 100 * MS  # with the next scan
    times_ns = np.arange(0, S, 10 * MS) + set_ns
    np.testing.assert_allclose(
        nod_from_message(first).pitch(times_ns + step_ns), before[-1].pitch(times_ns), atol=0.02
    )


@pytest.mark.parametrize('step_ns', STEPS)
def test_a_step_of_the_assembler_s_clock_alone_changes_nothing(run, step_ns):
    """The stamps are those of another machine: no scan is dropped, and the nod goes on."""
    right, even, _, _ = run(0)
    clouds, commands, drops, _ = run(step_ns, of='assembler')
    assert [c.header.stamp for _, c in clouds] == [c.header.stamp for _, c in right]
    assert not [reason for reason in drops if 'clock' in reason]
    assert [nod_from_message(c) for _, c in commands] == [nod_from_message(c) for _, c in even]


@pytest.mark.parametrize('step_ns', STEPS)
def test_a_step_of_the_robot_s_clock_alone_gives_no_wrong_cloud(run, log, step_ns):
    """The assembler learns of it by the stamps only; scans around the step are dropped."""
    right, _, _, _ = run(0)
    clouds, _, drops, _ = run(step_ns, of='robot')
    by_stamp = {time_ns(cloud.header.stamp): cloud for _, cloud in right}
    begin_ns, wrong = log.scans[0].stamp_ns, []
    for came_ns, cloud in clouds:
        is_set = came_ns - begin_ns >= STEP_AT * S
        stamp_ns = time_ns(cloud.header.stamp)
        even = by_stamp.get(stamp_ns - (step_ns if is_set else 0), by_stamp.get(stamp_ns))
        if np.abs(coordinates(cloud) - coordinates(even)).max() > 0.02:
            wrong.append((came_ns - begin_ns) / S)
    assert not wrong
    dropped = dropped_scans(clouds, drops, begin_ns)
    assert len(clouds) + dropped == len(right)
    assert dropped <= 5


@pytest.mark.parametrize('offset_ns', [-3600 * S, -500 * MS, -50 * MS, 500 * MS, 3 * S])
def test_sweeps_are_chosen_by_the_clock_of_the_stamps(run, offset_ns):
    """Each begins later than it is commanded, by the devices' clock."""
    _, commands, _, _ = run(0, 'nod_mode:=feedback', offset_ns=offset_ns, of='assembler')
    later = [(at_ns, time_ns(c.start_time)) for at_ns, c in commands if time_ns(c.start_time)]
    first = {}
    for at_ns, start_ns in later:
        first.setdefault(start_ns, at_ns)
    _, even, _, _ = run(0, 'nod_mode:=feedback')
    chosen = len({time_ns(c.start_time) for _, c in even} - {0})
    assert chosen > 5
    assert len(first) >= chosen - 1
    for start_ns, at_ns in list(first.items())[1:]:
        assert 0 < start_ns - at_ns < 250 * MS

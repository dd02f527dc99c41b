"""A servo that does not do as it is told, in virtual time: what the loop makes of it."""

from nodlidar_common.nod import Nod
from nodlidar_servo.following import RETRY
from nodlidar_sim.devices import rx_table as table
from nodlidar_sim.world.faulty_servo import FaultyServo
import numpy as np
import pytest
from test_servo_loop import Bench, NOD, START_NS, SWEEP

SLOW = Nod(-0.6136, 0.6136, 3.0, 30721, START_NS)
SMALL = Nod(-0.15, 0.15, SWEEP, 4001, START_NS)
FAST = Nod(-0.6136, 0.6136, 0.2, 2001, START_NS)


class FaultyBench(Bench):
    """A bench whose servo nods already, and whose motion may fail."""

    def __init__(self, nod=NOD, **options):
        super().__init__(motion=FaultyServo(position=0.2, history=1e6), **options)
        self.nod = nod
        self.run_for(2.0)
        assert not self.following.fault

    def run_for(self, seconds):
        return self.run(seconds, self.nod)

    def run_until(self, condition):
        """Run until a condition is met; return after which time [s], 10 if it never is."""
        begin_ns = self.clock()
        while not condition() and self.clock() - begin_ns < 10e9:
            self.run(0.01, self.nod)
        return (self.clock() - begin_ns) / 1e9

    def here(self):
        return float(self.motion.position(np.array([self.clock()]))[0])


def block(bench):
    bench.motion.blocked = True
    bench.motion.brake(bench.clock())


def freeze(bench):
    bench.motion.frozen = bench.here()


def reset_torque_limit(bench):
    bench.emulator.table[table.TORQUE_LIMIT] = 0


def mend(bench):
    bench.motion.mend()


@pytest.mark.parametrize('nod', [NOD, SMALL, FAST])
@pytest.mark.parametrize('after', [0.0, 0.3])
@pytest.mark.parametrize('fault', [block, freeze])
def test_a_servo_that_stands_still_is_named_within_a_second_and_loses_its_torque(
    fault, after, nod
):
    bench = FaultyBench(nod)
    bench.run_for(after)
    fault(bench)
    assert bench.run_until(lambda: bench.following.fault) < 1.0
    assert 'does not follow: it stands still' in bench.following.fault
    bench.run_for(0.02)
    assert not bench.torque
    told = bench.following.fault
    assert bench.run_for(5.0) == []  # an encoder that stands still is not to be believed
    assert bench.following.fault == told
    mend(bench)
    assert bench.run_until(lambda: not bench.following.fault) < 3.0
    assert bench.torque
    assert len(bench.run_for(1.0)) >= 99


@pytest.mark.parametrize('nod', [NOD, FAST, SLOW])
@pytest.mark.parametrize('after', np.linspace(0.0, 0.8, 5))
def test_no_position_of_an_encoder_that_stands_still_is_published(nod, after):
    bench = FaultyBench(nod)
    bench.run_for(after * 2.0 * nod.sweep_duration)
    freeze(bench)
    samples = bench.run_for(2.0)
    truth = bench.motion.position(np.array([sample.stamp_ns for sample in samples]))
    errors = np.abs(np.array([sample.pitch for sample in samples]) - truth)
    # Of a cycle: the one in which it came to stand still.
    assert errors.max(initial=0.0) < max(0.035, 0.012 * nod.speed)
    assert bench.figures.withheld > 50


def test_a_torque_limit_that_was_reset_is_written_again():
    bench = FaultyBench()
    reset_torque_limit(bench)
    assert bench.run_until(lambda: bench.following.fault) < 1.0
    assert bench.run_until(lambda: not bench.following.fault) < RETRY + 1.0
    assert bench.emulator.table[table.TORQUE_LIMIT] == 1023


def test_a_motor_that_shut_itself_down_is_named_and_not_revived():
    bench = FaultyBench()
    bench.emulator.motor.load = 1.5
    bench.run_for(0.1)
    bench.emulator.motor.load = 0.0
    bench.run_for(5.0)
    assert bench.following.fault
    assert bench.emulator.table[table.TORQUE_LIMIT] == 0


def test_a_slow_nod_that_stands_still_is_named_when_it_is_off_by_the_limit():
    bench = FaultyBench(SLOW)
    bench.run_until(lambda: abs(bench.here()) < 0.1)
    block(bench)
    assert bench.run_until(lambda: bench.following.fault) < 0.25 / SLOW.speed + 0.5


@pytest.mark.parametrize('latency_timer', [0.0, 0.016])
@pytest.mark.parametrize('nod', [NOD, SMALL, FAST, SLOW])
def test_a_servo_that_follows_is_no_fault(nod, latency_timer):
    bench = FaultyBench(nod, latency_timer=latency_timer)
    bench.run_for(5.0)
    assert not bench.following.fault
    assert bench.figures.withheld == 0


def test_a_servo_without_commands_is_no_fault_wherever_it_is_turned():
    bench = FaultyBench()
    bench.run(1.0, nod=None)
    bench.motion.set_goal(bench.clock(), -0.5, 1.0)
    bench.run(2.0, nod=None)
    assert not bench.following.fault


@pytest.mark.parametrize('turn', [block, freeze])
def test_a_servo_that_stands_still_as_its_commands_end_is_believed_at_rest(turn):
    bench = FaultyBench()
    bench.run(0.4, nod=None)  # of command_timeout
    turn(bench)
    bench.run(1.0, nod=None)
    assert bench.figures.withheld > 5
    assert not bench.torque
    counted = bench.figures.samples
    assert len(bench.run(1.0, nod=None)) == 100
    assert bench.figures.samples == counted + 100


def test_the_fault_of_a_servo_ends_with_its_command():
    bench = FaultyBench()
    block(bench)
    bench.run_until(lambda: bench.following.fault)
    counted = bench.figures.samples
    assert bench.run(0.5, nod=None) == []
    assert bench.following.fault
    assert bench.figures.samples == counted
    bench.run(0.2, nod=None)
    assert not bench.following.fault
    assert len(bench.run(1.0, nod=None)) == 100
    assert not bench.torque

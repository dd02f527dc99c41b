"""The mapping of the lidar's clock against a simulated truth."""

from nodlidar_driver.device_clock import DeviceClock, enough_replies, TimeReply
import numpy as np
import pytest

HOST_NS = 1_700_000_000_000_000_000
LATENCY_MS = 98.7
WRAP = 2**24


class World:
    """A lidar's clock, a motor and a host that gets everything late.

    Times are in ms: `device` on the lidar's clock, from its start.
    """

    def __init__(self, seed, ppm=100.0, jitter=3.0, period=99.83, timer=0.0):
        self.random = np.random.default_rng(seed)
        self.rate, self.jitter, self.period, self.timer = 1.0 + ppm * 1e-6, jitter, period, timer
        self.device = 3000.0 + self.random.uniform(0.0, period)
        self.host_step = 0.0

    def host_ns(self, device, late=0.0):
        return HOST_NS + round((device / self.rate + late + self.host_step) * 1e6)

    def stamp(self):
        return int(self.timer + self.device) % WRAP

    def replies(self):
        replies = []
        while not enough_replies(replies):
            self.device += self.period
            arrival = self.host_ns(self.device, 0.02 + self.random.exponential(self.jitter))
            replies.append(TimeReply(self.stamp(), arrival))
        self.device += self.random.uniform(1.0, 2.0) * self.period
        return replies

    def clock(self):
        return DeviceClock(100.0, 70.9, self.replies())

    def scan(self, clock, late=None):
        """Let a rotation pass; return the error of step 0 [ms] and the ScanTime."""
        self.device += self.period
        late = self.random.exponential(self.jitter) if late is None else late
        time = clock.scan_time(self.stamp(), self.host_ns(self.device, LATENCY_MS + late))
        return (time.step_zero_ns - self.host_ns(self.device)) / 1e6, time

    def errors(self, clock, scans):
        return np.array([self.scan(clock)[0] for _ in range(scans)])


@pytest.mark.parametrize('ppm', [100.0, -100.0, 0.0])
def test_stamps_are_right_to_a_third_of_a_millisecond_under_jitter(ppm):
    worlds = [World(seed, ppm) for seed in range(12)]
    errors = np.array([world.errors(world.clock(), 320)[20:] for world in worlds])
    assert np.sqrt(np.mean(errors**2)) < 0.3
    assert abs(errors.mean()) < 0.25
    assert np.abs(errors.mean(axis=1)).max() < 0.5
    assert np.abs(errors).max() < 1.5


def test_stamps_are_right_to_a_tenth_of_a_millisecond_on_a_quiet_link():
    worlds = [World(seed, jitter=0.05) for seed in range(12)]
    errors = np.array([world.errors(world.clock(), 320)[20:] for world in worlds])
    assert np.sqrt(np.mean(errors**2)) < 0.12
    assert abs(errors.mean()) < 0.1
    assert np.abs(errors.mean(axis=1)).max() < 0.25


@pytest.mark.parametrize('ppm', [-480.0, 25.0, 480.0])
def test_drift_is_measured(ppm):
    world = World(3, ppm, jitter=1.0)
    clock = world.clock()
    errors = world.errors(clock, 400)
    assert clock.drift_ppm == pytest.approx(ppm, abs=5.0)
    assert np.abs(errors[100:]).max() < 1.0


def test_a_quiet_link_needs_few_answers_and_a_noisy_one_more():
    assert len(World(0, jitter=0.05).replies()) < 16
    assert len(World(0, jitter=3.0).replies()) == 24


def test_the_rotation_is_measured_in_host_time():
    world = World(4, ppm=200.0, jitter=0.1, period=99.5)
    clock = world.clock()
    world.errors(clock, 300)
    _, time = world.scan(clock)
    assert time.rotation == pytest.approx(0.0995 / world.rate, rel=3e-5)


def test_the_timers_wrap_goes_unnoticed():
    world = World(5, jitter=0.1, timer=WRAP - 3000.0 - 5000.0)
    clock = world.clock()
    errors = world.errors(clock, 200)
    assert world.stamp() < 20_000
    assert np.abs(errors).max() < 1.0
    assert clock.jumps == 0


def test_missing_scans_cost_nothing():
    world = World(6, jitter=0.1)
    clock = world.clock()
    world.errors(clock, 50)
    world.device += 7 * world.period
    error, time = world.scan(clock)
    assert time.turns == 8
    assert abs(error) < 0.5
    assert clock.jumps == 0


def test_a_host_that_was_busy_still_gets_the_right_time():
    world = World(7, jitter=0.1)
    clock = world.clock()
    world.errors(clock, 50)
    late = [800.0, 700.0, 600.0, 500.0, 400.0, 300.0, 200.0, 100.0, 0.0]
    errors = np.array([world.scan(clock, delay)[0] for delay in late])
    assert np.abs(errors).max() < 0.5
    assert clock.jumps == 0


def test_late_first_scans_are_forgotten_when_timely_ones_come():
    world = World(14, jitter=0.1)
    clock = world.clock()
    for late in [250.0, 150.0, 50.0]:
        world.scan(clock, late)
    errors = world.errors(clock, 100)
    assert np.abs(errors[20:]).max() < 0.5
    assert clock.jumps == 0
    assert clock.synchronised


@pytest.mark.parametrize('step', [-400_000.0, -700.0, 30_000.0, 400_000.0])
def test_a_step_of_the_host_clock_is_followed_at_once(step):
    world = World(8, jitter=0.5)
    clock = world.clock()
    world.errors(clock, 100)
    world.host_step = step
    errors = world.errors(clock, 100)
    assert clock.jumps == 1
    assert np.abs(errors[:10]).max() < 5.0
    assert np.abs(errors[20:]).max() < 0.5


def test_a_short_step_forward_is_followed_when_it_cannot_be_a_busy_host():
    world = World(9, jitter=0.5)
    clock = world.clock()
    world.errors(clock, 100)
    world.host_step = 300.0
    errors = world.errors(clock, 60)
    assert clock.jumps == 1
    assert np.abs(errors[12:]).max() < 5.0
    assert np.abs(errors[30:]).max() < 0.5


def test_a_lidar_that_restarted_is_followed_at_once():
    world = World(10, jitter=0.5)
    clock = world.clock()
    world.errors(clock, 100)
    world.timer = -world.device
    errors = world.errors(clock, 100)
    assert clock.jumps == 1
    assert np.abs(errors[:10]).max() < 5.0
    assert np.abs(errors[30:]).max() < 1.0


def test_without_time_mode_scans_are_taken_to_arrive_a_rotation_after_step_zero():
    world = World(11, jitter=0.1)
    clock = DeviceClock(100.0, 70.9, [])
    errors = world.errors(clock, 100)
    assert not clock.synchronised
    assert errors[50:].mean() == pytest.approx(LATENCY_MS - 100.0, abs=0.6)


def test_a_latency_that_cannot_be_is_not_believed():
    world = World(12, jitter=0.1)
    replies = [TimeReply(r.device_ms, r.arrival_ns + 400_000_000_000) for r in world.replies()]
    clock = DeviceClock(100.0, 70.9, replies)
    errors = world.errors(clock, 100)
    assert not clock.synchronised
    assert np.abs(errors).max() < 5.0


def test_uneven_answers_of_time_mode_still_align_the_clocks():
    world = World(13, jitter=0.05)
    replies = []
    for _ in range(24):
        world.device += world.random.uniform(2.0, 9.0)
        replies.append(TimeReply(world.stamp(), world.host_ns(world.device, 0.02)))
    errors = world.errors(DeviceClock(100.0, 70.9, replies), 300)
    assert np.abs(errors[100:]).max() < 0.5

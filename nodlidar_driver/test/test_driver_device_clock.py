"""The mapping of the lidar's clock against a simulated truth."""

from nodlidar_driver.clock.device_clock import DeviceClock
from nodlidar_driver.clock.time_mode import ClockError, enough_replies, TimeReply
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

    def host_ns(self, device, late=0.0):
        return HOST_NS + round((device / self.rate + late) * 1e6)

    def stamp(self):
        return int(self.timer + self.device) % WRAP

    def replies(self):
        replies = []
        while not enough_replies(replies, 100.0):
            asked = self.host_ns(self.device)
            self.device += self.period
            late = 0.02 + self.random.exponential(self.jitter)
            replies.append(TimeReply(self.stamp(), asked, self.host_ns(self.device, late)))
        self.device += self.random.uniform(1.0, 2.0) * self.period
        return replies

    def clock(self):
        return DeviceClock(100.0, 70.9, self.replies())

    def scan(self, clock, late=None, wrong=0):
        """Pass one revolution; return the error of step 0 [ms] and the ScanTime; NaN for none."""
        self.device += self.period
        late = self.random.exponential(self.jitter) if late is None else late
        arrival_ns = self.host_ns(self.device, LATENCY_MS + late)
        time = clock.scan_time((self.stamp() + wrong) % WRAP, arrival_ns)
        if time is None:
            return np.nan, None
        return (time.step_zero_ns - self.host_ns(self.device)) / 1e6, time

    def errors(self, clock, scans, late=None):
        """Return the errors of some scans [ms], without those that were refused."""
        errors = np.array([self.scan(clock, late)[0] for _ in range(scans)])
        return errors[~np.isnan(errors)]

    def stall(self, clock, duration, held=30):
        """Let the host stand still for a time [ms]; return the errors of the scans it then reads.

        The port holds the oldest scans and loses the others.
        """
        before, now = self.device, self.device + self.period
        ends = now + duration
        errors = []
        while self.device + self.period + LATENCY_MS < ends:
            late = ends - (self.device + self.period + LATENCY_MS)
            if self.device - before < held * self.period:
                errors.append(self.scan(clock, late)[0])
            else:
                self.device += self.period
        return np.array(errors)


def test_stamps_are_right_to_a_third_of_a_millisecond_under_jitter():
    worlds = [World(seed, ppm=-100.0) for seed in range(12)]
    errors = np.array([world.errors(world.clock(), 320)[-300:] for world in worlds])
    assert np.sqrt(np.mean(errors**2)) < 0.3
    assert abs(errors.mean()) < 0.25
    assert np.abs(errors.mean(axis=1)).max() < 0.5
    assert np.abs(errors).max() < 1.5


def test_stamps_are_right_to_a_tenth_of_a_millisecond_on_a_quiet_link():
    worlds = [World(seed, jitter=0.05) for seed in range(12)]
    errors = np.array([world.errors(world.clock(), 320)[-300:] for world in worlds])
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
    assert len(World(0, jitter=0.05).replies()) == 5
    assert 15 <= len(World(0, jitter=3.0).replies()) <= 24


def test_a_busy_host_asks_longer_until_the_clock_is_known():
    worlds = [World(seed, jitter=18.0) for seed in range(12)]
    replies = [world.replies() for world in worlds]
    assert np.median([len(each) for each in replies]) > 24
    clocks = [DeviceClock(100.0, 70.9, each) for each in replies]
    pairs = zip(worlds, clocks, strict=True)
    errors = np.array([world.errors(clock, 5, late=0.0).mean() for world, clock in pairs])
    assert np.sqrt(np.mean(errors**2)) < 1.0  # of which the answers leave 0.5 ms on average
    assert np.abs(errors).max() < 3.0


def test_answers_that_are_late_by_chance_and_much_are_not_believed():
    with pytest.raises(ClockError, match=r'answers are late by .* on average'):
        World(0, jitter=40.0).clock()


def test_the_revolution_is_measured_in_host_time():
    world = World(4, ppm=200.0, jitter=0.1, period=99.5)
    clock = world.clock()
    world.errors(clock, 300)
    _, time = world.scan(clock)
    assert time.revolution == pytest.approx(0.0995 / world.rate, rel=3e-5)


def test_the_timers_wrap_goes_unnoticed():
    world = World(5, jitter=0.1, timer=WRAP - 3000.0 - 5000.0)
    clock = world.clock()
    errors = world.errors(clock, 200)
    assert world.stamp() < 20_000
    assert np.abs(errors).max() < 1.0
    assert len(errors) == 199


def test_missing_scans_cost_nothing():
    world = World(6, jitter=0.1)
    clock = world.clock()
    world.errors(clock, 50)
    world.device += 7 * world.period
    error, time = world.scan(clock)
    assert time.revolutions == 8
    assert abs(error) < 0.5


@pytest.mark.parametrize('scans', [0, 5, 50, 400])
@pytest.mark.parametrize('stall', [200.0, 1100.0, 2000.0, 3000.0, 9000.0])
def test_scans_that_waited_for_a_host_that_stood_still_have_the_right_time(stall, scans):
    world = World(7, jitter=0.1)
    clock = world.clock()
    world.errors(clock, scans)
    waited = world.stall(clock, stall)
    later = world.errors(clock, 60)
    assert len(waited) >= min(stall / 101.0, 30.0) - 2.0
    errors = np.concatenate((waited, later))
    published = errors[~np.isnan(errors)]
    assert np.abs(published).max() < 1.3
    assert len(later) >= 59  # but for one that settles
    if scans:
        assert len(published) == len(errors)  # none is lost


def test_stalls_again_and_again_and_late_arrivals_with_a_heavy_tail():
    world = World(20, jitter=0.2)
    clock, errors = world.clock(), []
    for k in range(1800):
        late = min(0.2 * world.random.pareto(1.2), 90.0)
        errors.append(world.scan(clock, late)[0])
        if k % 97 == 50:
            errors += list(world.stall(clock, world.random.uniform(100.0, 4000.0)))
    errors = np.array(errors)
    assert not np.isnan(errors[1:]).any()
    assert np.nanmax(np.abs(errors)) < 1.5


@pytest.mark.parametrize('delay', [4.0, 8.0, 15.0, 40.0, 300.0])
@pytest.mark.parametrize('scans', [60, 400])
def test_a_line_that_becomes_slow_does_not_move_the_stamps(delay, scans):
    world = World(9, jitter=0.2)
    clock = world.clock()
    world.errors(clock, scans)
    late = [world.scan(clock, delay + world.random.exponential(0.2)) for _ in range(150)]
    errors = np.array([error for error, _ in late])
    assert np.abs(errors).max() < 1.5
    assert late[-1][1].late == pytest.approx(delay / 1e3, abs=0.002)
    assert np.abs(world.errors(clock, 100)).max() < 1.5


def test_a_line_that_stays_slow_makes_the_clocks_be_aligned_anew():
    world = World(15, jitter=0.2)
    clock = world.clock()
    world.errors(clock, 400)
    errors = [world.scan(clock, 300.0)[0] for _ in range(950)]
    assert np.abs(errors).max() < 2.0
    with pytest.raises(ClockError, match='all scans are late, now by 300 ms'):
        world.errors(clock, 100, late=300.0)


@pytest.mark.parametrize('wrong', [-5000, -700, -30, -8, -3, 3, 8, 30, 70, 200, 5000, 9_000_000])
@pytest.mark.parametrize('scans', [0, 1, 2, 50, 400])
def test_a_wrong_time_with_a_right_sum_costs_its_scan_only(wrong, scans):
    world = World(16, jitter=0.1)
    clock = world.clock()
    world.errors(clock, scans)
    assert np.isnan(world.scan(clock, wrong=wrong)[0])
    errors = np.array([world.scan(clock)[0] for _ in range(50)])
    assert np.nanmax(np.abs(errors)) < 0.8
    assert np.isnan(errors).sum() <= (2 if scans < 2 else 0)


@pytest.mark.parametrize('jolt', [-9.0, -2.5, 2.5, 9.0])
def test_a_motor_that_jolts_costs_a_scan_and_no_stamp(jolt):
    world = World(19, jitter=0.1)
    clock = world.clock()
    world.errors(clock, 60)
    for _ in range(4):
        world.device += jolt
        assert np.isnan(world.scan(clock)[0])
        errors = np.array([world.scan(clock)[0] for _ in range(40)])
        assert np.abs(errors).max() < 1.0


@pytest.mark.parametrize('wrong', [-300, -30, 30, 300])
def test_a_wrong_time_in_time_mode_is_left_out(wrong):
    world = World(17, jitter=0.1)
    replies = world.replies()
    replies[2] = TimeReply(
        replies[2].device_ms + wrong, replies[2].asked_ns, replies[2].arrival_ns
    )
    errors = world.errors(DeviceClock(100.0, 70.9, replies), 100)
    assert np.abs(errors).max() < 0.8


def test_a_line_that_is_slow_from_the_beginning_is_told():
    world = World(18, jitter=0.1)
    slow = [
        TimeReply(r.device_ms, r.asked_ns, r.arrival_ns + 300_000_000) for r in world.replies()
    ]
    with pytest.raises(ClockError, match='answers take 400 ms or more instead of 100 ms'):
        DeviceClock(100.0, 70.9, slow)


def test_late_first_scans_are_forgotten_when_timely_ones_come():
    world = World(14, jitter=0.1)
    clock = world.clock()
    late = [world.scan(clock, late)[0] for late in [250.0, 250.0, 150.0, 50.0]]
    assert np.nanmax(np.abs(late)) < 0.8
    assert np.abs(world.errors(clock, 100)).max() < 0.8


@pytest.mark.parametrize('step', [-3_000.0, -40.0, 40.0, 700.0, 400_000.0])
def test_a_lidar_s_timer_that_was_set_makes_the_clocks_be_aligned_anew(step):
    world = World(10, jitter=0.5)
    clock = world.clock()
    world.errors(clock, 100)
    world.timer = step
    assert np.isnan(world.scan(clock)[0])
    with pytest.raises(ClockError):
        world.errors(clock, 4)


def test_without_time_mode_scans_are_taken_to_arrive_a_revolution_after_step_zero():
    world = World(11, jitter=0.1)
    clock = DeviceClock(100.0, 70.9, [])
    errors = world.errors(clock, 100)
    assert not clock.synchronised
    assert errors[50:].mean() == pytest.approx(LATENCY_MS - 100.0, abs=0.6)


def test_a_latency_that_cannot_be_is_not_believed():
    world = World(12, jitter=0.1)
    replies = [
        TimeReply(r.device_ms, r.asked_ns + 400_000_000_000, r.arrival_ns + 400_000_000_000)
        for r in world.replies()
    ]
    clock = DeviceClock(100.0, 70.9, replies)
    with pytest.raises(ClockError, match='do not fit'):
        world.errors(clock, 100)


def test_uneven_answers_of_time_mode_still_align_the_clocks():
    world = World(13, jitter=0.05)
    replies = []
    for _ in range(24):
        world.device += world.random.uniform(2.0, 9.0)
        now_ns = world.host_ns(world.device, 0.02)
        replies.append(TimeReply(world.stamp(), now_ns - 2_000_000, now_ns))
    errors = world.errors(DeviceClock(100.0, 70.9, replies), 300)
    assert np.abs(errors[100:]).max() < 0.5


@pytest.mark.parametrize('period', [80.0, 120.0, 125.0, 133.3, 140.0])
@pytest.mark.parametrize('seed', range(2))
def test_of_a_motor_at_another_speed_than_the_lidar_states_no_scans_are_dated(period, seed):
    """Every third to seventh of such stamps is whole nominal revolutions after the first."""
    world = World(seed, period=period)
    clock, times = world.clock(), []
    with pytest.raises(ClockError, match='its motor turns at another speed'):
        times.extend(world.scan(clock)[1] for _ in range(20))
    assert len([time for time in times if time is not None]) <= 1

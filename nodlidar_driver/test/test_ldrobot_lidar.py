"""An LD19 from bytes to dated scans, against the truth of an emulated one in virtual time."""

import math

from nodlidar_common.errors import DeviceError, PortError, StoppedError
from nodlidar_common.ldrobot import checksums, PACKET
from nodlidar_driver.base.reader import Reader
from nodlidar_driver.ldrobot.lidar import (
    BEAMS,
    LdrobotLidar,
    REFUSED,
    REVOLUTIONS,
    UNEVEN,
    USELESS,
)
from nodlidar_sim.devices.streaming_lidar import StreamingLidar
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000
ALL_AROUND = (-3.1416, 3.1416)
MS = 1_000_000


def room(azimuth):
    """Return ranges [m] that tell every azimuth [rad] from those near it."""
    return 3.0 + 2.0 * np.sin(azimuth) + np.cos(3.0 * azimuth)


class StallingPort(VirtualPort):
    """A tty, of at most 4095 bytes per read, whose reader stands still from a time on [s, s]."""

    def __init__(self, device, clock, after, duration):
        super().__init__(device, clock, 1.0)
        self._from_ns, self._duration_ns = clock() + round(after * 1e9), round(duration * 1e9)

    @property
    def in_waiting(self):
        return min(super().in_waiting, 4095)

    def read(self, size=1):
        data = super().read(size)
        if self._clock() >= self._from_ns:
            self._from_ns, stalled_ns = math.inf, self._clock() + self._duration_ns
            self._clock.advance_to(stalled_ns)
        return data


class Rig:
    """An emulated lidar on a virtual port, and when and where each beam was measured.

    `change` may replace the bytes that reach the host at a time [ns]; `stall` is when its reader
    stands still, and for how long [s].
    """

    def __init__(self, seed=0, ppm=0.0, change=None, window=ALL_AROUND, ranges=room, stall=None):
        self._beams, self._ranges = [], ranges
        self.clock = VirtualClock(START_NS)
        self.emulator = StreamingLidar(
            self._measure,
            start_ns=START_NS - 34_567_891,
            clock_rate=1.0 + ppm * 1e-6,
            seed=seed,
        )
        if change is not None:
            transmit = self.emulator.transmit
            self.emulator.transmit = lambda now_ns: change(transmit(now_ns), now_ns)
        if stall is None:
            self.port = VirtualPort(self.emulator, self.clock, 1.0)
        else:
            self.port = StallingPort(self.emulator, self.clock, *stall)
        self.lidar = LdrobotLidar(Reader(self.port, self.clock, 1.0), window, 16)

    def _measure(self, times_ns, azimuths):
        self._beams.append((times_ns, azimuths))
        return self._ranges(azimuths)

    def read(self, count):
        scans = [self.lidar.read() for _ in range(count)]
        self._truth = [np.concatenate(each) for each in zip(*self._beams, strict=True)]
        return scans

    def errors(self, scan):
        """Return errors of the stamps [ms] and azimuths [rad] of a scan, and the true azimuths."""
        times_ns, azimuths = self._truth
        beams = np.arange(len(scan.ranges))
        stated = scan.azimuth + scan.azimuth_step * beams
        period_ns = scan.revolution * abs(scan.azimuth_step) / math.tau * 1e9
        nearest = int(np.argmin(np.abs(times_ns - scan.stamp_ns)))

        def off(first):
            true = azimuths[first : first + len(beams)]
            return (stated - true + math.pi) % math.tau - math.pi

        # An error of time may be more than half of the time from beam to beam.
        near = range(max(nearest - 3, 0), nearest + 4)
        first = min(near, key=lambda first: np.sum(off(first) ** 2))
        true_ns, true = (of[first : first + len(beams)] for of in (times_ns, azimuths))
        return ((scan.stamp_ns - true_ns) + beams * period_ns) / MS, off(first), true


def gaps_in(rig, scan, worst_ms=0.4):
    """Check that all beams of a scan but its gaps are right; return which are gaps."""
    off_ms, _, true = rig.errors(scan)
    gaps = np.isnan(scan.ranges)
    assert np.abs(off_ms).max() < worst_ms
    np.testing.assert_allclose(scan.ranges[~gaps], room(true)[~gaps], atol=0.00051)
    return gaps


def late(worst_ms, seed=1):
    """Return what delivers bytes late by up to some ms, some much later."""
    rng, waiting = np.random.default_rng(seed), []

    def change(data, now_ns):
        delay_ms = 60.0 if rng.random() < 0.005 else rng.uniform(0.0, worst_ms)
        after_ns = waiting[-1][0] if waiting else 0
        waiting.append((max(now_ns + round(delay_ms * MS), after_ns), data))
        arrived = b''
        while waiting and waiting[0][0] <= now_ns:
            arrived += waiting.pop(0)[1]
        return arrived

    return change


def test_every_beam_has_its_own_time_and_azimuth():
    rig = Rig(ppm=-300.0)
    scans = rig.read(400)  # longer than the lidar's timer, which begins again after 30 s
    for scan in scans[20:]:
        off_ms, off, true = rig.errors(scan)
        assert np.abs(off_ms).max() < 0.2
        assert np.sqrt(np.mean(off**2)) < math.radians(0.3)  # its speed is not even
        np.testing.assert_allclose(scan.ranges, room(true), atol=0.00051)
    assert rig.lidar.arrivals.drift_ppm == pytest.approx(-300.0, abs=1.0)
    assert rig.lidar.lost.total() == 0
    stamps = np.array([scan.stamp_ns for scan in scans])
    np.testing.assert_allclose(np.diff(stamps) / MS, 100.0, atol=5.0)  # none is left out
    counts = [len(scan.ranges) for scan in scans]
    assert (min(counts), max(counts)) == pytest.approx((450, 450), abs=15)


def test_late_bytes_are_dated_by_the_lidar_s_clock():
    rig = Rig(ppm=50.0, change=late(8.0, seed=0))
    worst = [np.abs(rig.errors(scan)[0]).max() for scan in rig.read(400)[100:]]
    assert max(worst) < 2.0
    assert np.sqrt(np.mean(np.square(worst))) < 1.0


@pytest.mark.parametrize(
    'stall', [(0.05, 3.5), (0.3, 0.5), (0.3, 0.9), (0.3, 2.0), (0.8, 0.9), (0.95, 0.2), (3.0, 3.0)]
)
def test_scans_of_a_host_that_stands_still_while_it_connects_have_the_right_time(stall):
    rig = Rig(stall=stall)
    for scan in rig.read(60):
        off_ms, off, _ = rig.errors(scan)
        assert np.abs(off_ms).max() < 0.25
        assert np.sqrt(np.mean(off**2)) < math.radians(0.4)


@pytest.mark.parametrize(('worst_ms', 'most_revolutions'), [(8.0, 15), (19.0, 20), (60.0, 50)])
@pytest.mark.parametrize('seed', range(3))
def test_a_noisy_line_settles(seed, worst_ms, most_revolutions):
    rig = Rig(seed, change=late(worst_ms, seed))
    rig.lidar.connect()
    assert (rig.clock() - START_NS) / MS < 100.0 * most_revolutions


def test_a_line_that_is_too_late_to_date_scans_is_told():
    rig = Rig(change=late(400.0))
    with pytest.raises(DeviceError, match=r'late by \d+ ms at random: too much to date them'):
        rig.lidar.connect()
    assert (rig.clock() - START_NS) / MS == pytest.approx(10_000.0, abs=1_000.0)


def test_a_window_ahead_is_cut_out():
    rig = Rig(window=(-0.5, 1.0))
    for scan in rig.read(30):
        last = scan.azimuth + scan.azimuth_step * (len(scan.ranges) - 1)
        half = 0.5 * abs(scan.azimuth_step) + 1e-9
        assert scan.azimuth == pytest.approx(1.0, abs=half)
        assert last == pytest.approx(-0.5, abs=half)
        assert np.abs(rig.errors(scan)[0]).max() < 0.2


def test_ranges_are_those_of_rep_117():
    def ranges(azimuths):
        steps = np.array([np.inf, np.nan, 0.019, 0.02, 12.0, 12.1])
        return steps[np.arange(len(azimuths)) % 6]

    scan = Rig(ranges=ranges).read(1)[0]
    kinds, counts = np.unique(scan.ranges, return_counts=True)
    np.testing.assert_array_equal(kinds, np.array([0.02, 12.0, np.inf], np.float32))
    assert counts.min() > 70
    assert np.all((scan.confidences > 0) == np.isfinite(scan.ranges))


def test_lost_packets_leave_gaps_where_they_were():
    rng = np.random.default_rng(5)
    size = PACKET.itemsize

    def lose(data, now_ns):
        kept = [data[i : i + size] for i in range(0, len(data), size)]
        return b''.join(each for each in kept if rng.random() > 0.1)

    rig = Rig(change=lose)
    lost = beams = 0
    for scan in rig.read(200):
        gaps = gaps_in(rig, scan)
        assert np.sqrt(np.mean(rig.errors(scan)[1] ** 2)) < math.radians(0.4)
        lost, beams = lost + int(gaps.sum()), beams + len(gaps)
    assert lost / beams == pytest.approx(0.1, abs=0.02)
    assert rig.lidar.lost[REFUSED] == 0
    assert rig.lidar.lost[USELESS] == 0


def test_changed_bytes_cost_the_beams_of_their_packets_only():
    rng = np.random.default_rng(6)

    def change(data, now_ns):
        data = bytearray(data)
        if data and rng.random() < 0.2:
            data[rng.integers(len(data))] ^= 1 << rng.integers(8)
        return bytes(data)

    rig = Rig(change=change)
    for scan in rig.read(200):
        gaps_in(rig, scan)
    packets = rig.lidar.lost[USELESS] / PACKET.itemsize
    assert packets == pytest.approx(0.2 * 200 * 450 / 48, rel=0.3)
    assert rig.lidar.lost[BEAMS] == pytest.approx(12 * packets, rel=0.1)


def changed(change, chosen):
    """Return what changes some packets, which a function chooses by number; sums are right."""
    count = 0

    def apply(data, now_ns):
        nonlocal count
        packets = np.frombuffer(data, PACKET).copy()
        kept = []
        for packet in packets:
            kept += [packet] if not chosen(count) else change(packet)
            count += 1
        made = np.array(kept, PACKET)
        made['checksum'] = checksums(made.view(np.uint8).reshape(-1, PACKET.itemsize))
        return made.tobytes()

    return apply


@pytest.mark.parametrize(
    ('swing', 'phase', 'window'),
    [
        (0.5, 1.57, ALL_AROUND),
        (2.0, 1.57, ALL_AROUND),
        (2.0, 3.14, ALL_AROUND),
        (2.0, 1.57, (-3.14, 3.14)),
    ],
)
def test_a_motor_that_turns_unevenly_costs_no_beam(swing, phase, window):
    """The speed swings once a revolution, so that beams are off by some degrees."""

    def swung(packet):
        packet = packet.copy()
        for name in ('start_angle', 'end_angle'):
            angle = packet[name] / 100.0
            angle += swing * math.sin(math.radians(angle) + phase)
            packet[name] = round(100.0 * angle) % 36_000
        return [packet]

    rig = Rig(change=changed(swung, lambda _: True), window=window)
    scans = rig.read(100)
    duration = (scans[-1].stamp_ns - scans[0].stamp_ns) / 1e9
    assert sum(len(scan.ranges) for scan in scans[:-1]) == pytest.approx(4500 * duration, abs=5)
    assert rig.lidar.lost.total() == 0


def turned(name, degrees):
    """Return what turns an angle of a packet."""

    def change(packet):
        packet[name] = (packet[name] + round(degrees * 100)) % 36_000
        return [packet]

    return change


def with_timer(off_ms):
    def change(packet):
        packet['timer'] = (packet['timer'] + off_ms) % 30_000
        return [packet]

    return change


@pytest.mark.parametrize('at', range(440, 478, 13))
@pytest.mark.parametrize(
    'change',
    [
        lambda packet: [packet, packet],
        *(turned('start_angle', degrees) for degrees in (-8.0, -5.0, 3.0, 5.0, 8.0)),
        *(turned('end_angle', degrees) for degrees in (-8.0, -7.0, -5.0, 5.0)),
        *(with_timer(off_ms) for off_ms in (-9, 9, 700, 15_000)),
    ],
)
def test_a_wrong_packet_with_a_right_sum_costs_its_beams_only(change, at):
    rig = Rig(change=changed(change, lambda number: number == at))
    scans = rig.read(5)
    assert rig.lidar.lost[REFUSED] == 1
    for scan in scans:
        assert gaps_in(rig, scan).sum() <= 12


@pytest.mark.parametrize('speed', [0, 1800, 7200])
def test_the_speed_that_the_lidar_states_does_not_matter(speed):
    def change(packet):
        packet['speed'] = speed
        return [packet]

    rig = Rig(change=changed(change, lambda number: True))
    assert max(np.abs(rig.errors(scan)[0]).max() for scan in rig.read(20)) < 0.2


@pytest.mark.parametrize('begin', range(450, 488, 9))
@pytest.mark.parametrize('count', [1, 3, 30])
def test_packets_lost_anywhere_in_a_revolution_are_gaps_and_counted(begin, count):
    rig = Rig(change=changed(lambda packet: [], lambda n: begin <= n < begin + count))
    lost = 0
    for scan in rig.read(12):
        lost += gaps_in(rig, scan, worst_ms=0.6).sum()
        assert len(scan.ranges) == pytest.approx(450, abs=15)
    missing = rig.lidar.lost[REVOLUTIONS]
    assert rig.lidar.lost[BEAMS] == pytest.approx(lost, abs=1)  # one may be behind the window
    assert lost + 450 * missing == pytest.approx(12 * count, abs=25 if missing else 1)


@pytest.mark.parametrize(('begin', 'left'), [(482, 1), (480, 2), (482, 4), (460, 3)])
def test_the_few_packets_that_are_left_of_a_revolution_have_the_right_time(begin, left):
    """The lidar's timer has whole milliseconds, of which few packets do not tell the rate."""
    rig = Rig(ppm=300.0, change=changed(lambda packet: [], lambda n: 0 <= n - begin < 37 - left))
    scans = rig.read(14)
    assert max(np.isnan(scan.ranges).sum() for scan in scans) > 200
    assert max(np.abs(rig.errors(scan)[0]).max() for scan in scans) < 0.8


def test_a_window_without_a_beam_is_an_error_but_not_one_whose_beams_are_lost():
    with pytest.raises(DeviceError, match=r'no beam is between 3\.1415 and 3\.1416 rad'):
        Rig(window=(3.1415, 3.1416)).read(100)
    rig = Rig(window=(-0.5, 1.0), change=changed(lambda packet: [], lambda n: 450 <= n < 480))
    assert all(len(scan.ranges) == pytest.approx(107, abs=5) for scan in rig.read(12))


def test_a_motor_that_slows_down_is_not_published():
    rig = Rig()
    rig.read(5)
    turn = rig.emulator._turn

    def slower():
        rig.emulator._speed *= 0.98
        return turn()

    rig.emulator._turn = slower
    for scan in rig.read(3):
        _, off, _ = rig.errors(scan)
        assert np.abs(off).max() <= scan.uneven + 0.01 < math.radians(3.6)
    assert rig.lidar.lost[UNEVEN] > 0


def test_a_motor_that_stands_is_named():
    rig = Rig()
    rig.read(1)
    rig.emulator._turn = lambda: (np.zeros(4), np.full((4, 12), 90.0))
    with pytest.raises(DeviceError, match='the motor does not turn'):
        rig.read(9)


def test_a_weak_return_is_not_trusted():
    def change(packet):
        packet['points']['confidence'][3] = 15
        return [packet]

    rig = Rig(change=changed(change, lambda number: True))
    scan = rig.read(1)[0]
    assert np.isnan(scan.ranges).mean() == pytest.approx(1 / 12, abs=0.01)
    assert set(scan.confidences[np.isnan(scan.ranges)]) == {15.0}


def test_a_healthy_lidar_loses_nothing():
    rig = Rig()
    rig.emulator.transmit(START_NS + 1_000_000_000)
    rig.read(20)
    assert rig.lidar.lost.total() == 0


def test_a_pause_of_the_line_costs_whole_revolutions_which_are_counted():
    def pause(data, now_ns):
        return b'' if 5_000 <= (now_ns - START_NS) / MS < 5_330 else data

    rig = Rig(change=pause)
    scans = rig.read(60)
    due = round((scans[-1].stamp_ns - scans[0].stamp_ns) / (100 * MS)) + 1
    assert rig.lidar.lost[REVOLUTIONS] == due - len(scans) > 0
    # Of a revolution of which little came, the milliseconds of the timer give less.
    assert max(np.abs(rig.errors(scan)[0]).max() for scan in scans) < 0.7


def test_a_lidar_that_was_restarted_is_read_anew():
    rig = Rig()
    rig.read(20)
    rig.emulator._timer_ms -= 1000
    with pytest.raises(DeviceError, match="the lidar's timer jumped"):
        rig.read(3)


def test_another_lidar_is_none():
    clock = VirtualClock(START_NS)
    urg = UrgEmulator(lambda times, azimuths: room(azimuths), start_ns=START_NS)
    port = VirtualPort(urg, clock, 1.0)
    port.write(b'BM\nMD0044072501000\n')
    port.read(10)
    lidar = LdrobotLidar(Reader(port, clock, 1.0), ALL_AROUND, 16)
    with pytest.raises(DeviceError, match='that are no packets of an LD06 or LD19'):
        lidar.connect()


def test_silence_is_an_error():
    rig = Rig(change=lambda data, now_ns: data if now_ns < START_NS + 3000 * MS else b'')
    with pytest.raises(DeviceError, match=r'the lidar sent nothing for 1\.0 s'):
        rig.read(40)


def test_an_unplugged_lidar_is_an_error_of_the_port():
    rig = Rig()
    rig.port.unplug()
    with pytest.raises(PortError):
        rig.read(1)


def test_a_stop_ends_the_wait():
    rig = Rig()
    reader = Reader(rig.port, rig.clock, 1.0, lambda: False)
    lidar = LdrobotLidar(reader, ALL_AROUND, 16)
    with pytest.raises(StoppedError):
        lidar.connect()

"""An emulated LD19: its bytes by an independent reading of the manual, and their times."""

import struct

from nodlidar_sim.devices.streaming_lidar import StreamingLidar
import numpy as np
import pytest

START_NS, S = 1_700_000_000_000_000_000, 10**9
SIZE = 47


def crc(data):
    """CRC-8 with polynomial x^8 + x^6 + x^3 + x^2 + 1, bit by bit."""
    value = 0
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value << 1) ^ 0x4D if value & 0x80 else value << 1
        value &= 0xFF
    return value


def run(seconds, **options):
    """Return the packets of some time, when they came [ns], and what was measured."""
    beams = []

    def measure(times_ns, azimuths):
        beams.append((times_ns, azimuths))
        return 3.0 + np.sin(azimuths)

    lidar = StreamingLidar(measure, start_ns=START_NS, **options)
    packets, came_ns, now_ns = [], [], START_NS
    while (now_ns := lidar.next_event_ns()) < START_NS + seconds * S:
        data = lidar.transmit(now_ns)
        assert lidar.next_event_ns() > now_ns
        packets += [data[i : i + SIZE] for i in range(0, len(data), SIZE)]
        came_ns += [now_ns] * (len(data) // SIZE)
    times_ns, azimuths = (
        np.concatenate(each).reshape(-1, 12) for each in zip(*beams, strict=True)
    )
    return packets, np.array(came_ns), times_ns, np.degrees(-azimuths)


def test_packets_are_as_the_manual_has_them():
    ppm = 200.0
    packets, _, times_ns, angles = run(31, clock_rate=1.0 + ppm * 1e-6)
    assert len(packets) == pytest.approx(375 * 31, abs=6)
    assert all(packet[-1] == crc(packet[:-1]) for packet in packets[::20])
    timers, distances = [], []
    for packet, degrees in zip(packets, angles, strict=True):
        assert packet[:2] == b'\x54\x2c'
        speed, start, *points, end, timer, _ = struct.unpack('<2xHH' + 'HB' * 12 + 'HHB', packet)
        assert speed == pytest.approx(3600.0, rel=0.03)
        assert start / 100 == pytest.approx(degrees[0] % 360.0, abs=0.0051)
        off = (end / 100 - degrees[-1] + 180.0) % 360.0 - 180.0
        assert abs(off) < 0.0051
        timers.append(timer)
        distances.append(points[::2])
    expected = 3000 + 1000 * np.sin(-np.radians(angles))
    np.testing.assert_allclose(distances, expected, atol=0.51)
    assert min(timers) >= 0
    assert max(timers) < 30_000
    passed = np.diff(timers) % 30_000
    assert passed.sum() == pytest.approx(np.ptp(times_ns[:, 0]) / 1e6 * (1 + ppm * 1e-6), abs=1.1)


def test_packets_come_just_after_their_last_beam_some_together():
    _, came_ns, times_ns, _ = run(2)
    late_ms = (came_ns - times_ns[:, -1]) / 1e6
    line_ms = 470 / 230.4  # bits, bits per ms
    assert late_ms.min() == pytest.approx(line_ms, abs=1e-4)
    assert late_ms.max() == pytest.approx(line_ms + 3 * 12 / 4.5, abs=1e-3)


def test_its_speed_wanders_about_ten_revolutions_a_second():
    _, _, _, angles = run(60, seed=3)
    turned = np.unwrap(angles[:, 0], period=360.0)
    speed = np.diff(turned[::375]) / 360.0
    assert speed.mean() == pytest.approx(10.0, abs=0.02)
    assert 0.001 < speed.std() / 10.0 < 0.005


def test_what_it_does_not_see_is_distance_0():
    seen = iter([np.inf, np.nan, 0.01, 13.0, 0.02, 12.0] * 8)
    lidar = StreamingLidar(lambda times, _: np.array([next(seen) for _ in times]), start_ns=0)
    data = lidar.transmit(lidar.next_event_ns())
    distances = np.frombuffer(
        data,
        np.dtype([('head', 'V6'), ('points', [('mm', '<u2'), ('c', 'u1')], 12), ('tail', 'V5')]),
    )
    assert distances['points']['mm'].ravel().tolist() == [0, 0, 0, 0, 20, 12000] * 8

"""The emulated URG-04LX in virtual time: rhythm, clock, streams, resynchronisation."""

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common import scip
from nodlidar_sim.devices.faults import FaultyDevice
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
import numpy as np
import pytest

MS = 1_000_000
START = 1_700_000_000_000_000_000


def one_metre(times_ns, azimuth):
    return np.ones(len(times_ns))


def millimetre_per_step(times_ns, azimuth):
    """Range 1000 + step, as in the worked example; 390 sees nothing, 395 is lost."""
    steps = np.rint(azimuth * 1024 / (2 * np.pi)).astype(int) + 384
    ranges = (1000.0 + steps) / 1000.0
    ranges[steps == 390] = np.inf
    ranges[steps == 395] = np.nan
    return ranges


class Host:
    """Sends commands and takes replies, as a driver does."""

    def __init__(self, measure=one_metre, fault_seed=None, **options):
        self.clock = VirtualClock(START)
        self.urg = UrgEmulator(measure, start_ns=START, **options)
        device = self.urg if fault_seed is None else FaultyDevice(self.urg, fault_seed)
        self.device = device
        self.port = VirtualPort(device, self.clock, timeout=0.5)

    def elapsed_ms(self):
        return (self.clock() - START) / MS

    def wait_until(self, milliseconds):
        self.clock.advance_to(START + round(milliseconds * MS))

    def reply(self):
        """Return the lines of the next reply, or None if there is none in time."""
        reply = b''
        while not reply.endswith(b'\n\n'):
            byte = self.port.read(1)
            if not byte:
                return None
            reply += byte
        return reply[:-2].split(b'\n')

    def ask(self, command):
        self.port.write(command + b'\n')
        return self.reply()

    def status(self, command):
        echo, status, *_ = self.ask(command)
        assert echo == command
        return scip.strip_sum(status).decode()


def ranges_of(lines, characters=3):
    return scip.decode(scip.join_blocks(lines[3:]), characters).tolist()


def timer_of(line):
    return int(scip.decode(scip.strip_sum(line), 4)[0])


def test_the_worked_example_byte_for_byte():
    host = Host(millimetre_per_step, timer=6968830 - 100)
    host.port.write(b'MD0380040201001\n')
    reply = host.port.read(1000)
    assert reply == (
        b'MD0380040201001\n00P\n\n'
        b'MD0380040201000\n99b\nJUGnD\n'
        b'0ET0EU0EV0EW0EX0EY0EZ0E[0E\\0E]0000E_0E`0Ea0Eb0070Ed0Ee0Ef0Eg0Eh0k\n'
        b'Ei0Ej=\n\n'
    )
    assert len(reply) == 121


@pytest.mark.parametrize('sent_at', [0.0, 0.1, 37.0, 99.9, 100.0, 1234.5])
@pytest.mark.parametrize('phase', [0.0, 0.25])
def test_commands_are_answered_at_the_end_of_the_rotation(sent_at, phase):
    host = Host(rotation_phase=phase)
    host.wait_until(sent_at)
    assert host.status(b'QT') == '00'
    period, first = 100.0, 100.0 * (1 - phase)
    revolutions_over = max(0, int(np.floor((sent_at - first) / period)) + 1)
    expected = first + revolutions_over * period + 1000 * len('QT\n00P\n\n') / (2137 / 2.3e-3)
    assert host.elapsed_ms() == pytest.approx(expected, abs=1e-3)


def test_a_full_scan_takes_2137_bytes_and_2_3_ms():
    host = Host()
    host.ask(b'MD0044072501000')
    host.port.read(1)  # the first piece of the message has come
    first_piece = host.elapsed_ms()
    host.port.read(2136)
    assert 200.0 < first_piece < 200.6
    assert host.elapsed_ms() == pytest.approx(202.3, abs=0.01)
    assert host.port.in_waiting == 0


def test_scans_come_once_a_rotation_and_the_echo_counts_down():
    host = Host()
    assert host.ask(b'MD0044072500003') == [b'MD0044072500003', b'00P']
    for remaining, end in ((2, 202.3), (1, 302.3), (0, 402.3)):
        lines = host.reply()
        assert lines[:2] == [b'MD00440725000%02d' % remaining, b'99b']
        assert ranges_of(lines) == [1000] * 682
        assert host.elapsed_ms() == pytest.approx(end, abs=0.01)
    assert host.reply() is None


def test_the_laser_goes_off_with_the_last_of_the_scans_asked_for():
    host = Host()
    host.ask(b'BM')
    host.ask(b'MD0044072500002')
    host.reply()
    assert host.urg.sensor.laser
    host.reply()
    assert not host.urg.sensor.laser
    assert host.status(b'GD0044072501') == '10'


def test_an_endless_stream_ends_with_qt():
    host = Host()
    host.ask(b'MS0044072500000')
    for _ in range(12):
        lines = host.reply()
        assert lines[0] == b'MS0044072500000'
        assert ranges_of(lines, 2) == [1000] * 682
    assert host.status(b'QT') == '00'
    assert not host.urg.sensor.laser
    assert host.reply() is None


def test_interval_skips_rotations():
    host = Host()
    host.ask(b'MD0044072500203')
    ends = []
    for _ in range(3):
        host.reply()
        ends.append(host.elapsed_ms())
    np.testing.assert_allclose(ends, [202.3, 502.3, 802.3], atol=0.01)


def test_clusters_and_windows():
    host = Host(millimetre_per_step)
    host.ask(b'MD0388039603001')
    assert ranges_of(host.reply()) == [1388, 1391, 1394]


def test_a_string_is_echoed_in_every_message():
    host = Host()
    assert host.ask(b'MD0044072500002;a Z.9_+@')[0] == b'MD0044072500002;a Z.9_+@'
    assert host.reply()[0] == b'MD0044072500001;a Z.9_+@'


@pytest.mark.parametrize('end', [b'\n', b'\r', b'\r\n', b'\n\r\n'])
def test_terminators(end):
    host = Host()
    host.port.write(b'QT' + end)
    assert host.reply() == [b'QT', b'00P']
    assert host.reply() is None


def test_a_command_may_come_in_pieces():
    host = Host()
    host.port.write(b'V')
    host.wait_until(150)
    host.port.write(b'V\r')
    host.port.write(b'\nPP\n')
    assert host.reply()[0] == b'VV'
    assert host.reply()[0] == b'PP'


def test_the_stamp_is_the_timer_at_step_0_and_not_at_the_first_beam_asked_for():
    host = Host(timer=500)
    host.ask(b'MD0700072500001')
    assert timer_of(host.reply()[2]) == 600


def test_each_beam_is_measured_at_its_own_instant():
    """A target that recedes by 1 m/s shows the time at which each beam was measured."""
    host = Host(lambda times_ns, azimuth: 1.0 + (times_ns - START) / 1e9)
    host.ask(b'MD0044072500001')
    steps = np.arange(44, 726)
    expected = 1000.0 + 100.0 + steps * 100.0 / 1024
    np.testing.assert_allclose(ranges_of(host.reply()), expected, atol=0.5001)


@pytest.mark.parametrize('rate', [1.0, 1.0003, 0.9995])
def test_stamps_follow_the_sensors_own_clock(rate):
    """Device time of revolution k is (k + 1 - phase) revolutions after the start."""
    host = Host(clock_rate=rate, timer=123.4, rotation_phase=0.4)
    host.ask(b'MD0044004400000')
    for k in range(200):
        stamp = timer_of(host.reply()[2])
        assert stamp == int(123.4 + 60.0 + 100.0 * k + 1e-6)
    assert host.elapsed_ms() == pytest.approx((60.0 + 100.0 * 200) / rate, abs=0.1)


def test_the_timer_wraps_at_24_bits():
    host = Host(timer=2**24 - 150)
    host.ask(b'MD0044004400003')
    assert [timer_of(host.reply()[2]) for _ in range(3)] == [2**24 - 50, 50, 150]


def test_the_timer_wraps_after_hours_of_idleness():
    host = Host()
    host.wait_until(4 * 3600e3 + 39 * 60e3 + 37.216e3 + 250)
    host.ask(b'TM0')
    answered_ms = host.elapsed_ms() + 100
    assert timer_of(host.ask(b'TM1')[2]) == int(answered_ms) % 2**24


def test_time_mode_reads_the_timer_at_the_answer():
    host = Host(clock_rate=1.01, timer=77)
    host.wait_until(30)
    assert host.status(b'TM0') == '00'
    for _ in range(5):
        before = host.elapsed_ms()
        stamp = timer_of(host.ask(b'TM1')[2])
        assert 77 + 1.01 * before - 1 <= stamp <= 77 + 1.01 * host.elapsed_ms()
    assert host.status(b'TM2') == '00'


def test_reset_sets_the_timer_to_0():
    host = Host(timer=5_000)
    assert host.status(b'RS') == '00'
    host.ask(b'TM0')
    assert timer_of(host.ask(b'TM1')[2]) == 200


def test_one_scan_is_of_the_turn_that_ends():
    host = Host(timer=10)
    host.ask(b'BM')
    host.wait_until(150)
    lines = host.ask(b'GD0044072500')
    assert lines[1] == b'00P'
    assert timer_of(lines[2]) == 110
    assert ranges_of(lines) == [1000] * 682
    assert ranges_of(host.ask(b'GS0044072501'), 2) == [1000] * 682


def test_no_beam_is_measured_that_nobody_asked_for():
    calls = []

    def measure(times_ns, azimuth):
        calls.append(len(times_ns))
        return np.ones(len(times_ns))

    host = Host(measure)
    host.ask(b'BM')
    host.wait_until(1000)
    host.ask(b'VV')
    assert calls == []
    assert host.urg.next_event_ns() is None
    host.ask(b'MD0044072500101')
    host.reply()
    assert calls == [682]


def test_beams_are_measured_when_the_last_one_has_been_sent():
    called_at = []

    def measure(times_ns, azimuth):
        called_at.append((host.clock() - times_ns[-1]) / MS)
        return np.ones(len(times_ns))

    host = Host(measure)
    host.ask(b'MD0044072500005')
    for _ in range(5):
        host.reply()
    assert called_at == [0.0] * 5


def test_a_status_query_in_mid_stream_ends_the_stream():
    host = Host()
    host.ask(b'MD0044072500000')
    host.reply()
    host.port.write(b'II\n')
    assert host.reply()[0] == b'II'
    assert host.reply() is None


def test_a_refused_command_leaves_the_stream_alone():
    host = Host()
    host.ask(b'MD0044072500000')
    assert host.status(b'BM') == '02'
    assert host.reply()[1] == b'99b'


def test_of_commands_of_one_type_that_come_at_once_only_the_first_is_obeyed():
    host = Host()
    host.port.write(b'VV\nVV;again\nPP\nMD0044072500001\nMD0044072500002\n')
    answers = [host.reply()[:2] for _ in range(6)]
    statuses = [scip.strip_sum(status).decode() for _, status in answers]
    assert statuses == ['00', '0B', '00', '00', '0B', '99']
    assert host.reply() is None
    assert host.status(b'VV') == '00'


def test_a_new_stream_replaces_the_old_one():
    host = Host()
    host.ask(b'MD0044072500000')
    host.reply()
    host.port.write(b'MS0044004400001\n')
    assert host.reply() == [b'MS0044004400001', b'00P']
    assert host.reply()[0] == b'MS0044004400000'
    assert host.reply() is None


def test_the_bit_rate_has_no_effect_over_usb():
    host = Host()
    host.ask(b'SS115200')
    host.ask(b'QT')
    assert host.elapsed_ms() == pytest.approx(200, abs=0.1)


def test_motor_speed_changes_the_rhythm_and_not_the_timer():
    host = Host()
    assert host.status(b'CR10') == '00'
    host.ask(b'MD0044004400003')
    stamps = [timer_of(host.reply()[2]) for _ in range(3)]
    assert np.diff(stamps).tolist() == pytest.approx([111, 111], abs=1)


def test_a_sensor_that_powers_up_in_scip_1_1():
    host = Host(scip11=True)
    assert host.ask(b'QT') == [b'QT', b'E']
    assert host.ask(b'VV') == [b'VV', b'E']
    version = host.ask(b'V')
    assert version[:3] == [b'V', b'0', b'VEND:Hokuyo Automatic Co.,Ltd.']
    assert [line[:5] for line in version[3:]] == [b'PROD:', b'FIRM:', b'PROT:', b'SERI:']
    assert host.ask(b'SCIP2.0') == [b'SCIP2.0', b'0']
    assert host.status(b'QT') == '00'
    assert host.status(b'SCIP2.0') == '0E'


def test_identity():
    host = Host()

    def information(command):
        lines = host.ask(command)
        assert lines[:2] == [command, b'00P']
        return dict(map(scip.parse_information, lines[2:]))

    version = information(b'VV')
    assert list(version) == ['VEND', 'PROD', 'FIRM', 'PROT', 'SERI']
    assert version['PROD'] == 'SOKUIKI Sensor URG-04LX-UG01(Simple-URG)'
    assert (version['PROT'], version['SERI']) == ('SCIP 2.0', 'H0000001')
    assert information(b'PP') == {
        'MODL': 'URG-04LX-UG01(Simple-URG)(Hokuyo Automatic Co.,Ltd.)',
        **{'DMIN': '20', 'DMAX': '5600', 'ARES': '1024', 'AMIN': '44', 'AMAX': '725'},
        **{'AFRT': '384', 'SCAN': '600'},
    }
    status = information(b'II')
    assert list(status) == ['MODL', 'LASR', 'SCSP', 'MESM', 'SBPS', 'TIME', 'STAT']
    assert (status['LASR'], status['TIME']) == ('OFF', f'{300:06X}')
    assert status['SCSP'] == 'Initial(600[rpm])'
    host.ask(b'BM')
    host.ask(b'CR05')
    status = information(b'II')
    assert (status['LASR'], status['SCSP']) == ('ON', '5%Down(570[rpm])')


@settings(max_examples=60)
@given(st.lists(st.binary(max_size=200), max_size=8), st.booleans())
def test_garbage_never_crashes_it_and_it_answers_afterwards(pieces, scip11):
    host = Host(scip11=scip11)
    for piece in pieces:
        host.port.write(piece)
        host.port.read(500)
    host.port.write(b'\nSCIP2.0\nTM2\n')
    host.port.timeout = 0.2
    while host.port.read(100):
        pass
    host.port.write(b'QT\n')
    host.port.timeout = 0.5
    assert host.reply() == [b'QT', b'00P']


def test_memory_stays_bounded_for_any_input():
    host = Host()
    host.urg.receive(b'x' * 1_000_000, START)
    host.urg.receive(b'QT\n' * 1000, START)
    assert len(host.urg._line) <= 80
    assert len(host.urg._pending) == 8


@pytest.mark.parametrize(('corrupt', 'drop'), [(0.01, 0.0), (0.0, 0.01)])
def test_bad_wiring_damages_about_the_share_that_is_asked_for(corrupt, drop):
    host = Host(fault_seed=3)
    host.device.corrupt_rate, host.device.drop_rate = corrupt, drop
    host.port.write(b'MD0044072500000\n')
    host.wait_until(2_650)
    received = host.port.read(host.port.in_waiting)
    sound = Host()
    sound.port.write(b'MD0044072500000\n')
    sound.wait_until(2_650)
    expected = sound.port.read(sound.port.in_waiting)
    assert len(received) / len(expected) == pytest.approx(1.0 - drop, abs=0.002)
    if corrupt:
        wrong = np.frombuffer(received, np.uint8) != np.frombuffer(expected, np.uint8)
        assert wrong.mean() == pytest.approx(corrupt, abs=0.002)


def test_a_mute_device_sends_nothing():
    host = Host(fault_seed=0)
    host.device.mute = True
    assert host.ask(b'QT') is None
    host.device.mute = False
    assert host.ask(b'QT') == [b'QT', b'00P']


def test_on_scan_is_called_before_each_scan_is_sent():
    host, sent = Host(millimetre_per_step), []

    def note_and_spoil(revolution):
        sent.append((revolution.times_ns[0], revolution.codes[44]))
        revolution.timer += 30 * (len(sent) == 2)

    host.urg.on_scan = note_and_spoil
    host.ask(b'MD0044072501003')
    timers = [timer_of(host.reply()[2]) for _ in range(3)]
    assert len(sent) == 3
    assert np.diff(timers).tolist() == [130, 70]
    assert [code for _, code in sent] == [1044] * 3
    step_44_ns = START + 100 * MS + round(44 * 100 * MS / 1024)
    assert [at_ns - step_44_ns for at_ns, _ in sent] == [0, 100 * MS, 200 * MS]

"""The SCIP 2.0 session: byte fixtures of the specification's form, and an emulated lidar."""

from collections import Counter
import re

from hypothesis import given, settings
from hypothesis import strategies as st
from lidar_rig import before, FULL, Rig, START_NS
from nodlidar_common.errors import DeviceError, PortError, StoppedError
from nodlidar_driver.scip.lidar import Lidar
from nodlidar_driver.scip.scan_window import ScanWindow
from nodlidar_driver.scip.scip_answer import STOP
from nodlidar_driver.scip.scip_client import ScipClient
from nodlidar_driver.scip.scip_port import ScipPort
from nodlidar_sim.devices.faults import FaultyDevice
from nodlidar_sim.ports.virtual_port import VirtualPort
import numpy as np
import pytest
import serial

WINDOW = ScanWindow(380, 402, 1, 0)
# A recorded form of answer: range 1000 + step, but step 390 is 0 and step 395 is 7.
SCAN = (
    b'MD0380040201000\n99b\nJUGnD\n'
    b'0ET0EU0EV0EW0EX0EY0EZ0E[0E\\0E]0000E_0E`0Ea0Eb0070Ed0Ee0Ef0Eg0Eh0k\nEi0Ej=\n\n'
)
LASER_ON = b'BM\n00P\n\n'
STARTED = b'MD0380040201000\n00P\n\n'
EXPECTED = np.arange(1380, 1403)
EXPECTED[[10, 15]] = 0, 7


class ScriptedPort:
    """A port on which all the answers wait already; an empty read is a timeout."""

    def __init__(self, data):
        self.timeout = None
        self.data = bytearray(data)
        self.sent = b''

    @property
    def in_waiting(self):
        return 0

    def read(self, size=1):
        data = bytes(self.data[:size])
        del self.data[:size]
        return data

    def write(self, data):
        self.sent += data
        return len(data)


class Client(ScipClient):
    """A client that remembers what was no good scan."""

    def __init__(self, port, clock):
        self.drops = Counter()
        super().__init__(ScipPort(port, clock, 1.0), lambda reason: self.drops.update([reason]))


def streaming(data):
    """Return a client whose lidar has begun to stream."""
    port = ScriptedPort(LASER_ON + STARTED + data)
    client = Client(port, lambda: 12345)
    client.start_scanning(WINDOW)
    return client


def test_the_worked_example():
    client = streaming(SCAN)
    scan = client.read_scan()
    np.testing.assert_array_equal(scan.codes, EXPECTED)
    assert (scan.device_ms, scan.arrival_ns) == (6968830, 12345)


def test_the_commands_that_are_sent():
    port = ScriptedPort(b'BM\n02R\n\nMD0044072502300\n00P\n\n')
    ScipClient(ScipPort(port, lambda: 0, 1.0)).start_scanning(ScanWindow(44, 725, 2, 3))
    assert port.sent == b'BM\nMD0044072502300\n'


@given(st.integers(0, len(SCAN) - 1), st.integers(1, 255))
def test_a_corrupted_byte_costs_its_scan_at_most_and_is_counted(position, change):
    broken = bytearray(SCAN)
    broken[position] ^= change
    client = streaming(bytes(broken) + SCAN + SCAN)
    read = [client.read_scan(), client.read_scan()]
    for scan in read:
        np.testing.assert_array_equal(scan.codes, EXPECTED)
    in_the_echo = position < 15  # which has no sum; what it says is known anyway
    assert in_the_echo or client.drops.total() >= 1


@given(st.integers(1, len(SCAN) - 1), st.binary(max_size=40))
def test_lost_and_foreign_bytes_cost_no_more_than_their_scan(cut, garbage):
    client = streaming(SCAN[:cut] + garbage.replace(b'M', b'') + SCAN + SCAN)
    for _ in range(2):
        np.testing.assert_array_equal(client.read_scan().codes, EXPECTED)


def test_drops_are_counted_by_reason():
    bad_sum = SCAN.replace(b'0ET', b'0EU')
    line_lost = SCAN.replace(b'Ei0Ej=\n', b'')
    no_header = SCAN[20:]
    client = streaming(bad_sum + line_lost + no_header + SCAN)
    client.read_scan()
    assert client.drops == {'checksum': 1, 'incomplete': 1, 'resync': 1}


def test_a_stop_to_verify_an_error_is_waited_out():
    client = streaming(b'MD0380040201000\n21S\n\nMD0380040201000\n98a\n\n' + SCAN)
    np.testing.assert_array_equal(client.read_scan().codes, EXPECTED)
    assert client.drops == {'verifying': 1}


def test_a_hardware_fault_in_mid_stream():
    client = streaming(SCAN + b'MD0380040201000\n50U\n\n')
    client.read_scan()
    with pytest.raises(DeviceError, match=r'status 50: .*hardware fault'):
        client.read_scan()


@pytest.mark.parametrize(
    ('answer', 'words'),
    [
        (b'BM\n01Q\n\n', "'BM' with status 01: the laser is faulty"),
        (LASER_ON + b'MD0380040201000\n04T\n\n', 'status 04: end step is out of range'),
        (LASER_ON + b'MD0380040201000\n0Aa\n\n', 'status 0A: internal error'),
    ],
)
def test_refusals_say_what_they_mean(answer, words):
    client = ScipClient(ScipPort(ScriptedPort(answer), lambda: 0, 1.0))
    with pytest.raises(DeviceError, match=words):
        client.start_scanning(WINDOW)


def test_silence_is_an_error():
    with pytest.raises(DeviceError, match=r'sent nothing for 1\.0 s'):
        streaming(SCAN[:30]).read_scan()


@pytest.mark.parametrize(('standstill', 'most'), [(2.5, 1.3), (3.5, 0.4)])
def test_a_laser_that_a_guard_turned_off_is_noticed_at_once(standstill, most):
    rig = Rig()
    lidar = rig.lidar()
    lidar.read()
    rig.port.write(b'QT\n')
    gone_on_ns = rig.clock() + round(standstill * 1e9)
    rig.clock.advance_to(gone_on_ns)
    with pytest.raises(DeviceError, match=r'the lidar (has )?sent'):
        lidar.read()
    assert rig.clock() - gone_on_ns < most * 1e9


def test_a_lidar_that_was_not_turned_off_goes_on_after_a_standstill():
    rig = Rig()
    lidar = rig.lidar()
    lidar.read()
    rig.clock.advance_to(rig.clock() + 4_000_000_000)
    for _ in range(50):
        scan = lidar.read()
    assert rig.clock() - scan.stamp_ns < 200_000_000


def test_a_sender_that_is_no_lidar_is_given_up():
    client = streaming(b'$GPGGA,123519,4807.038,N\r\n' * 6000)
    with pytest.raises(DeviceError, match=r'not SCIP 2\.0'):
        client.read_scan()


# Against the emulated lidar.


@pytest.mark.parametrize(
    ('options', 'commands'),
    [
        ({}, []),
        ({'scip11': True}, []),
        ({}, [b'TM0']),
        ({}, [b'BM', b'MD0044072501000']),
        ({}, [b'MS0000076801000', b'BOGUS']),
        ({}, [b'MD00440725']),
    ],
)
def test_a_session_starts_from_any_state(options, commands):
    rig = Rig(**options)
    for command in commands:
        rig.send(command)
    client = ScipClient(ScipPort(rig.port, rig.clock, 1.0))
    client.start_session()
    assert not rig.emulator.sensor.laser
    assert client.version().serial_number == 'H0000001'
    capabilities = client.capabilities()
    assert (capabilities.first_step, capabilities.last_step) == (44, 725)
    assert capabilities.revolution == 0.1
    assert client.state().health == 'Sensor works well.'


def test_a_lidar_in_firmware_update_mode_is_told_as_such():
    rig = Rig()
    rig.emulator.sensor.firmware_update = True
    with pytest.raises(DeviceError, match=r"'QT' with status 0I: .* firmware update mode"):
        ScipClient(ScipPort(rig.port, rig.clock, 1.0)).start_session()


def test_a_lidar_that_stays_in_scip_1_1_is_told_as_such():
    port = ScriptedPort(b'')
    client = ScipClient(ScipPort(port, lambda: 0, 1.0))
    port.write = lambda command: port.data.extend(command + b'E\n\n' if command.strip() else b'')
    with pytest.raises(DeviceError, match='does not answer as a SCIP'):
        client.start_session()


def test_half_a_command_of_another_program_does_no_harm():
    rig = Rig()
    rig.port.write(b'MD0044')
    client = ScipClient(ScipPort(rig.port, rig.clock, 1.0))
    client.start_session()
    assert client.version().protocol == 'SCIP 2.0'


def test_time_mode_tells_the_timer():
    rig = Rig(timer=1000.0)
    client = ScipClient(ScipPort(rig.port, rig.clock, 1.0))
    client.start_session()
    replies = client.time_replies(lambda replies: len(replies) >= 5)
    for reply in replies:
        truth = 1000.0 + 3000.0 + (reply.arrival_ns - START_NS) / 1e6
        assert truth - 1.2 < reply.device_ms < truth
    client.start_scanning(FULL)
    assert len(client.read_scan().codes) == 682


@pytest.mark.parametrize('answer', [b'', b'\n', b'\n00\n', b'\n0000\n', b'\n0000@\n0000@\n'])
def test_an_answer_of_time_mode_without_a_time_is_an_error(answer):
    port = ScriptedPort(b'TM0\n00P\n\nTM1\n00P' + answer + b'\n\n')
    client = ScipClient(ScipPort(port, lambda: 0, 1.0))
    with pytest.raises(DeviceError):
        client.time_replies(lambda replies: len(replies) >= 2)


def test_a_lidar_that_refuses_time_mode_gives_no_replies():
    rig = Rig()
    client = ScipClient(ScipPort(rig.port, rig.clock, 1.0))
    client.start_session()
    rig.emulator.sensor.refuse_next(b'0E')
    assert client.time_replies(lambda replies: len(replies) >= 5) == []


def test_stopping_turns_the_laser_off():
    rig = Rig()
    lidar = rig.lidar()
    lidar.read()
    assert rig.emulator.sensor.laser
    lidar.disconnect()
    assert not rig.emulator.sensor.laser
    assert rig.emulator.sensor.stream is None


def test_faults_of_the_emulated_lidar():
    rig = Rig()
    lidar = rig.lidar()
    lidar.read()
    rig.emulator.sensor.faults.come(21, 98)
    lidar.read()
    assert rig.account.lost['verifying'] == 1
    rig.emulator.sensor.faults.come(60)
    with pytest.raises(DeviceError, match='status 60'):
        lidar.read()


def test_unplugging_is_a_port_error():
    rig = Rig()
    lidar = rig.lidar()
    lidar.read()
    rig.port.unplug()
    with pytest.raises(PortError, match='went away'):
        lidar.read()
    with pytest.raises(PortError, match='went away'):
        lidar.disconnect()


@pytest.mark.parametrize('tenths', range(0, 30, 3))
@pytest.mark.parametrize('silent', [False, True])
def test_connecting_ends_soon_when_told_and_leaves_the_laser_off(tenths, silent):
    rig = Rig()
    faults = FaultyDevice(rig.emulator)
    port = VirtualPort(faults, rig.clock)
    end_ns = START_NS + tenths * 100_000_000

    def keep_going():
        faults.mute = silent and rig.clock() + 200_000_000 >= end_ns
        return rig.clock() < end_ns

    scip = ScipPort(port, rig.clock, 5.0, keep_going)
    lidar = Lidar(scip, lambda _: FULL, rig.account)
    with pytest.raises(StoppedError):
        start_and_read(lidar)
    faults.mute = False
    lidar.disconnect()
    assert rig.clock() < end_ns + 1_200_000_000
    assert not rig.emulator.sensor.laser


def start_and_read(lidar):
    lidar.connect()
    while True:
        lidar.read()


def test_a_lidar_that_refuses_to_stream_can_be_stopped():
    rig = Rig()
    before(rig.emulator, b'MD0044072501000', lambda: rig.emulator.sensor.refuse_next(b'0A'))
    lidar = Lidar(ScipPort(rig.port, rig.clock, 1.0), lambda _: FULL, rig.account)
    with pytest.raises(DeviceError, match='status 0A'):
        lidar.connect()
    assert rig.emulator.sensor.laser
    lidar.disconnect()
    assert not rig.emulator.sensor.laser


def test_a_stop_that_is_not_confirmed_is_an_error():
    port = ScriptedPort(SCAN)
    client = ScipClient(ScipPort(port, lambda: 0, 1.0))
    with pytest.raises(DeviceError, match='did not confirm'):
        client.stop()
    assert port.sent == b'\nQT\n' * 10


@pytest.mark.parametrize('lost', range(4))
@pytest.mark.parametrize('times', [1, 3])
def test_a_lost_byte_of_the_stop_request_does_not_leave_the_laser_on(lost, times):
    rig = Rig()
    lidar = rig.lidar()
    lidar.read()
    rig.port.write(b'MD00')  # what is left of a broken command
    receive, requests = rig.emulator.receive, []

    def receive_damaged(data, now_ns):
        requests.append(data)
        if len(requests) <= times:
            data = data[:lost] + data[lost + 1 :]
        receive(data, now_ns)

    rig.emulator.receive = receive_damaged
    lidar.disconnect()
    assert not rig.emulator.sensor.laser
    assert len(requests) <= times + 1


@pytest.mark.parametrize('delay_ms', [40, 300, 700])
def test_a_slow_line_confirms_a_stop(delay_ms):
    rig = Rig()
    faults = FaultyDevice(rig.emulator)
    port = VirtualPort(faults, rig.clock)
    lidar = Lidar(ScipPort(port, rig.clock, 1.0), lambda _: FULL, rig.account)
    lidar.connect()
    lidar.read()
    faults.delay_ns = delay_ms * 1_000_000
    lidar.disconnect()
    assert not rig.emulator.sensor.laser


@pytest.mark.parametrize(
    ('received', 'confirmed'),
    [
        (b'QT\n00P\n\n', True),
        (b'MD0044\n0Ee\n\nQT\n0Ee\n\n', True),
        (b'0ET0QT\n00P\n\n', False),  # the end of a scan
        (b'QT\n0B', False),
        (b'TQT\n00P\n\n', False),
    ],
)
def test_what_confirms_a_stop_is_an_answer_of_its_own(received, confirmed):
    assert bool(re.search(STOP.confirmation, received)) == confirmed


@pytest.mark.parametrize('command', ['\nQT', 'VV', 'II', 'TM1', 'BM', 'MD0044072501000'])
def test_unplugging_while_connecting_is_a_port_error(command):
    rig = Rig()
    before(rig.emulator, command.encode(), rig.port.unplug)
    with pytest.raises(PortError, match='went away'):
        rig.lidar()


def test_a_port_that_is_gone_before_the_first_command():
    rig = Rig()
    rig.port.unplug()
    with pytest.raises(PortError, match='went away'):
        ScipPort(rig.port, rig.clock, 1.0)


def test_serial_exceptions_are_port_errors():
    class Broken(ScriptedPort):
        def read(self, size=1):
            raise serial.SerialException('gone')

        def write(self, data):
            raise OSError(5, 'gone')

    client = ScipClient(ScipPort(Broken(b''), lambda: 0, 1.0))
    with pytest.raises(PortError):
        client.start_session()


@settings(max_examples=20)
@given(st.binary(max_size=300))
def test_noise_before_the_start_does_no_harm(noise):
    class Noisy:
        """The emulated lidar behind bytes that were waiting already."""

        def __init__(self, port):
            self.port, self.waiting, self.timeout = port, noise, None

        @property
        def in_waiting(self):
            return len(self.waiting) + self.port.in_waiting

        def read(self, size=1):
            self.port.timeout = self.timeout
            waiting, self.waiting = self.waiting[:size], self.waiting[size:]
            return waiting or self.port.read(size)

        def write(self, data):
            return self.port.write(data)

    rig = Rig()
    client = ScipClient(ScipPort(Noisy(rig.port), rig.clock, 1.0))
    client.start_session()
    assert client.version().protocol == 'SCIP 2.0'

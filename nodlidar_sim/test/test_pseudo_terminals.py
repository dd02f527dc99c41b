import os
import threading
import time

from nodlidar_common.errors import PortError
from nodlidar_common.serial_port import open_port
from nodlidar_sim.ports.pseudo_terminals import HostClock, PseudoTerminals
import pytest
from serial import SerialException


class Echo:
    """Sends every byte back as soon as it can."""

    def __init__(self):
        self.data = b''

    def receive(self, data, now_ns):
        self.data += data

    def transmit(self, now_ns):
        sent, self.data = self.data, b''
        return sent

    def next_event_ns(self):
        return None


class BitRateEcho(Echo):
    """Answers with the bit rate of the host."""

    host_bit_rate = None

    def receive(self, data, now_ns):
        self.data = f'{self.host_bit_rate:8}'.encode()


class Ticker(Echo):
    """Sends the index of each millisecond's tick."""

    def __init__(self):
        super().__init__()
        self.next_ns = time.time_ns()
        self.ticks = 0

    def transmit(self, now_ns):
        sent = b''
        while self.next_ns <= now_ns:
            sent += bytes((self.ticks % 256,))
            self.next_ns += 1_000_000
            self.ticks += 1
        return sent

    def next_event_ns(self):
        return self.next_ns


class Flood(Ticker):
    """Sends 100 kB every millisecond."""

    def transmit(self, now_ns):
        return super().transmit(now_ns) * 100_000


class Broken(Echo):
    def receive(self, data, now_ns):
        raise ZeroDivisionError('broken device')


def until(condition, limit=20.0):
    """Wait for what another thread does, or fail."""
    deadline = time.monotonic() + limit
    while not condition():
        assert time.monotonic() < deadline
        threading.Event().wait(0.001)


def wait_for(ports, limit=20.0):
    """Wait until emulated devices have ended, or fail."""
    waiting = threading.Thread(target=ports.wait, daemon=True)
    waiting.start()
    waiting.join(limit)
    assert not waiting.is_alive()


def test_two_devices_answer_byte_for_byte(tmp_path):
    every_byte = bytes(range(256))
    links = {'a': tmp_path / 'made' / 'a'}
    with PseudoTerminals({'a': Echo(), 'b': Echo()}, links) as ports:
        assert ports['a'] == str(links['a'])
        for name in 'ab':
            with open_port(ports[name], 115200, timeout=5.0) as port:
                port.write(every_byte)
                assert port.read(256) == every_byte
    assert not links['a'].is_symlink()


def test_a_second_user_is_refused():
    with (
        PseudoTerminals({'a': Echo()}) as ports,
        open_port(ports['a'], 115200, timeout=5.0),
        pytest.raises(PortError, match='in use'),
    ):
        open_port(ports['a'], 115200, timeout=5.0)


def test_it_is_known_whether_a_host_has_a_device_open():
    with PseudoTerminals({'a': Echo()}) as ports:
        assert not ports.in_use('a')
        with open_port(ports['a'], 115200, timeout=5.0):
            assert ports.in_use('a')
        assert not ports.in_use('a')


def test_a_device_that_speaks_first_is_heard_without_being_asked():
    with PseudoTerminals({'a': Ticker()}) as ports, open_port(ports['a'], 9600, 5.0) as port:
        ticks = port.read(200)
    first = ticks[0]
    assert ticks == bytes((first + i) % 256 for i in range(200))


def test_what_nobody_listens_to_is_lost():
    ticker = Ticker()
    with PseudoTerminals({'a': ticker}) as ports:
        until(lambda: ticker.ticks > 20)
        with open_port(ports['a'], 9600, 5.0) as port:
            assert port.read(1)[0] >= 20
        assert ports.dropped('a') == 0


def test_a_host_that_does_not_read_costs_bytes_and_no_memory():
    with PseudoTerminals({'a': Flood()}) as ports, open_port(ports['a'], 9600, 5.0) as port:
        until(lambda: ports.dropped('a') > 1_000_000)
        assert len(port.read(100_000)) == 100_000


def test_unplugging_hangs_up_and_plugging_in_works_again(tmp_path):
    link = tmp_path / 'a'
    with PseudoTerminals({'a': Echo()}, {'a': link}) as ports:
        with open_port(ports['a'], 9600, 5.0) as port:
            ports.close_device('a')
            with pytest.raises(SerialException):
                port.read(1)
        with pytest.raises(PortError, match='does not exist'):
            open_port(ports['a'], 9600, 5.0)
        ports.reopen('a')
        with open_port(ports['a'], 9600, 5.0) as port:
            port.write(b'again')
            assert port.read(5) == b'again'


def test_another_device_can_be_plugged_in():
    with PseudoTerminals({'a': Echo()}) as ports:
        ports.close_device('a')
        ports.reopen('a', Ticker())
        with open_port(ports['a'], 9600, 5.0) as port:
            assert len(port.read(3)) == 3


@pytest.mark.parametrize('bit_rate', [57600, 1_000_000])
def test_a_device_receives_the_bit_rate_of_its_host(bit_rate):
    with (
        PseudoTerminals({'a': BitRateEcho()}) as ports,
        open_port(ports['a'], bit_rate, 5.0) as port,
    ):
        port.write(b'?')
        assert int(port.read(8)) == bit_rate


def test_a_stale_link_is_replaced(tmp_path):
    link = tmp_path / 'a'
    link.symlink_to('/dev/nothing-here')
    with PseudoTerminals({'a': Echo()}, {'a': link}):
        assert os.readlink(link).startswith('/dev/pts/')


def test_created_folders_are_removed_in_the_end_and_others_stay(tmp_path):
    (tmp_path / 'there').mkdir()
    links = {'a': tmp_path / 'new' / 'left' / 'a', 'b': tmp_path / 'new' / 'b'}
    links['c'] = tmp_path / 'there' / 'c'
    with PseudoTerminals({name: Echo() for name in links}, links):
        assert all(link.is_symlink() for link in links.values())
    assert [path.name for path in tmp_path.rglob('*')] == ['there']


def test_a_created_folder_stays_if_others_use_it(tmp_path):
    with PseudoTerminals({'a': Echo()}, {'a': tmp_path / 'new' / 'a'}):
        (tmp_path / 'new' / 'other').write_text('kept')
    assert (tmp_path / 'new' / 'other').read_text() == 'kept'


def test_a_file_is_not_replaced(tmp_path):
    path = tmp_path / 'precious'
    path.write_text('kept')
    with (
        pytest.raises(PortError, match='no symbolic link'),
        PseudoTerminals({'a': Echo()}, {'a': path}),
    ):
        pass
    assert path.read_text() == 'kept'


def test_a_link_that_cannot_be_created_is_an_error(tmp_path):
    (tmp_path / 'file').write_text('')
    with (
        pytest.raises(PortError, match='cannot make the link'),
        PseudoTerminals({'a': Echo()}, {'a': tmp_path / 'file' / 'a'}),
    ):
        pass


def use_broken_device():
    with PseudoTerminals({'a': Broken()}) as ports, open_port(ports['a'], 9600, 5.0) as port:
        port.write(b'x')
        wait_for(ports)


def test_an_error_of_a_device_hangs_up_and_surfaces():
    with pytest.raises(ZeroDivisionError, match='broken device'):
        use_broken_device()


def test_the_host_clock_follows_the_wall_clock():
    clock = HostClock()
    assert abs(clock() - time.time_ns()) < 1_000_000_000
    assert clock() <= clock()


def test_with_a_grace_a_device_answers_until_its_host_has_closed_it():
    with PseudoTerminals({'echo': Echo()}) as ports:
        with open_port(ports['echo'], 115200, timeout=5.0) as host:
            host.write(b'1')
            assert host.read(1) == b'1'
            ports.stop(grace=30.0)
            host.write(b'2')
            assert host.read(1) == b'2'
        began = time.monotonic()
        wait_for(ports)
        assert time.monotonic() - began < 10.0


def test_a_grace_comes_to_an_end():
    with (
        PseudoTerminals({'echo': Echo()}) as ports,
        open_port(ports['echo'], 115200, timeout=5.0),
    ):
        ports.stop(grace=0.05)
        wait_for(ports)

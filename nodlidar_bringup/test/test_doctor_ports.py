"""Faults of ports, on pseudo-terminals with emulated devices."""

from dataclasses import replace
import os
from pathlib import Path
import socket
import threading
import time
from types import SimpleNamespace

from nodlidar_bringup.checks import ask as asking
from nodlidar_bringup.checks.ask import ask
from nodlidar_bringup.checks.finding import Level
from nodlidar_bringup.checks.port_facts import port_facts
from nodlidar_bringup.checks.ports import (
    Answer,
    check_ports,
    may_ask,
    Port,
    same_port,
    ServoSettings,
)
from nodlidar_common.serial_port import open_port
from nodlidar_sim.devices import rx_table as table
from nodlidar_sim.devices import x_table
from nodlidar_sim.devices.device import SilentDevice
from nodlidar_sim.devices.faults import EchoingDevice
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.shared_bus import SharedBus
from nodlidar_sim.devices.streaming_lidar import StreamingLidar
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.devices.x_servo import XServoEmulator
from nodlidar_sim.ports.pseudo_terminals import HostClock, PseudoTerminals
from nodlidar_sim.world.ideal_servo import IdealServo
import numpy as np
import pytest


def lidar(**options):
    return UrgEmulator(
        lambda times, azimuth: np.ones(len(times)), start_ns=HostClock()(), **options
    )


def servo(wheel=False, **options):
    emulated = RxServoEmulator(IdealServo(), **{'baud': 1, 'return_delay': 0, **options})
    if wheel:
        emulated.table[table.CW_LIMIT], emulated.table[table.CCW_LIMIT] = 0, 0
    return emulated


def x_servo(mode=3, **options):
    emulated = XServoEmulator(IdealServo(), baud=3, **options)
    emulated.table[x_table.OPERATING_MODE] = mode
    return emulated


class Protocol2(SilentDevice):
    """Answers a ping of Protocol 2.0 with the example of ROBOTIS' e-Manual: ID 1, model 1030."""

    reply = b''

    def receive(self, data, now_ns):
        if bytes.fromhex('FFFFFD00FE0300013142') in data:
            self.reply = bytes.fromhex('FFFFFD00010700550006042665 5D')

    def transmit(self, now_ns):
        reply, self.reply = self.reply, b''
        return reply


def ld19():
    return StreamingLidar(lambda times, _: np.ones(len(times)), start_ns=time.time_ns())


@pytest.mark.parametrize(
    ('at_lidar', 'at_servo', 'expected'),
    [
        (lidar(scip11=True), servo(), set()),
        (servo(), lidar(), {'ports swapped'}),
        (lidar(), servo(wheel=True), {'wheel mode'}),
        (
            lidar(),
            servo(baud=34, servo_id=5, wheel=True),
            {'wrong bit rate', 'wrong ID', 'wheel mode'},
        ),
        (lidar(), SilentDevice(), {'no answer'}),
        (lidar(), ld19, {'wrong device'}),
        (ld19, servo(), set()),
        (servo(), ld19, {'ports swapped'}),
        (lidar(), x_servo(), set()),
        (lidar(), x_servo(mode=1, servo_id=3), {'wheel mode', 'wrong ID'}),
    ],
)
def test_what_answers_shows_the_fault(at_lidar, at_servo, expected):
    devices = {'lidar': at_lidar, 'servo': at_servo}  # a lidar that streams begins only now
    devices = {name: each() if callable(each) else each for name, each in devices.items()}
    with PseudoTerminals(devices) as ports:
        facts = [port_facts(name, ports[name]) for name in ('lidar', 'servo')]
        asked = [
            Port(port.device, port.path, target=port.target, answer=ask(port)) for port in facts
        ]
    found = check_ports(*asked, ServoSettings())
    assert {each.check for each in found if each.level == Level.FAULT} == expected, found


def test_a_servo_of_protocol_2_answers():
    with PseudoTerminals({'servo': Protocol2()}) as ports:
        assert ask(Port('servo', ports['servo'])) == Answer('servo', 'model 1030', 1_000_000, 1)


@pytest.mark.parametrize('kind', [servo, x_servo])
def test_of_several_servos_on_a_bus_the_one_of_the_node_answers(kind):
    with PseudoTerminals({'servo': SharedBus([kind(servo_id=k) for k in (1, 2, 5)])}) as ports:
        port = Port('servo', ports['servo'])
        answer = ask(port, 2)
        assert (answer.device, answer.servo_id) == ('servo', 2)
        found = check_ports(None, replace(port, answer=answer), ServoSettings(servo_id=2))
    assert 'wrong ID' not in {each.check for each in found}


def test_an_adapter_that_echoes_hides_no_fault():
    plain, echoing = servo(wheel=True), EchoingDevice(servo(wheel=True))
    answers = []
    for device in (plain, echoing):
        with PseudoTerminals({'servo': device}) as ports:
            answers.append(ask(Port('servo', ports['servo'])))
    assert answers[0] == answers[1]
    assert 'wheel mode' in answers[1].wrong_mode


@pytest.mark.parametrize('device', ['lidar', 'servo'])
def test_a_lidar_that_streams_is_named_soon(device):
    with PseudoTerminals({device: ld19()}) as ports:
        begin = time.monotonic()
        port = Port(device, ports[device])
        assert ask(port) == Answer('lidar', streams=True)
        assert time.monotonic() - begin < 10.0  # usually 0.7 s; each exchange has its deadline


def test_a_servo_is_found_by_a_busy_computer(monkeypatch):
    def after_a_stall():
        time.sleep(0.1)  # longer than the wait for an answer
        return time.monotonic()

    monkeypatch.setattr(asking, 'time', SimpleNamespace(monotonic=after_a_stall))
    with PseudoTerminals({'servo': servo()}) as ports:
        assert ask(Port('servo', ports['servo'])) == Answer('servo', 'RX-24F', 1_000_000, 1)


def test_a_lidar_that_was_left_measuring_answers():
    with PseudoTerminals({'lidar': lidar()}) as ports:
        with open_port(ports['lidar'], 115_200, 5.0) as port:
            port.write(b'BM\nMD0044072501000\n')
            assert len(port.read(3000)) == 3000  # of a second scan
        assert ask(Port('lidar', ports['lidar'])).model.startswith('SOKUIKI Sensor')


def test_a_port_in_use_is_not_asked_and_its_user_is_named():
    with PseudoTerminals({'servo': servo()}) as ports, open_port(ports['servo'], 1_000_000, 0.1):
        port = port_facts('servo', ports['servo'])
        assert ask(port) is None
    assert any(f'(process {os.getpid()})' in user for user in port.users)
    found = check_ports(Port('lidar', '/dev/ttyACM0'), port, ServoSettings())
    assert 'port in use' in {each.check for each in found}


def test_the_user_of_a_port_is_found_while_it_opens_and_closes_other_files():
    ended = threading.Event()

    def open_and_close():
        while not ended.is_set():
            os.close(os.open('/dev/null', os.O_RDONLY))

    # The lowest free number goes to the file that comes and goes: it is listed before the port.
    free = os.open('/dev/null', os.O_RDONLY)
    with PseudoTerminals({'servo': servo()}) as ports, open_port(ports['servo'], 1_000_000, 0.1):
        os.close(free)
        other = threading.Thread(target=open_and_close)
        other.start()
        try:
            found = [port_facts('servo', ports['servo']).users for _ in range(50)]
        finally:
            ended.set()
            other.join()
    assert all(any(f'(process {os.getpid()})' in user for user in users) for users in found)


def test_what_the_system_says_of_an_adapter(tmp_path):
    """A folder like /sys/class/tty/ttyUSB0 of an FTDI adapter."""
    device = tmp_path / 'usb1' / '1-1' / '1-1:1.0' / 'ttyUSB0'
    device.mkdir(parents=True)
    (device / 'latency_timer').write_text('16\n')
    (device.parents[1] / 'idVendor').write_text('0403\n')
    (device.parents[1] / 'idProduct').write_text('6014\n')
    port = tmp_path / 'ttyUSB0'
    port.touch(mode=0o000)
    described = tmp_path / 'tty' / 'ttyUSB0'
    described.mkdir(parents=True)
    (described / 'device').symlink_to(device)
    facts = port_facts('servo', str(port), tmp_path / 'tty')
    assert (facts.usb_id, facts.latency_timer) == ('0403:6014', 16)
    assert facts.may_use == (os.geteuid() == 0)
    assert facts.group == Path(port).group()


def test_a_missing_port(tmp_path):
    assert not port_facts('lidar', str(tmp_path / 'ttyACM0')).exists


def test_a_lidar_at_a_tcp_address_is_asked():
    def reply():
        connection, _ = server.accept()
        with connection:
            while b'VV\n' not in connection.recv(64):
                pass
            connection.sendall(b'VV\n00P\nPROD:UST-20LX;a\nSERI:H1;b\n\n')

    with socket.create_server(('127.0.0.1', 0)) as server:
        answering = threading.Thread(target=reply, daemon=True)
        answering.start()
        port = port_facts('lidar', f'tcp://127.0.0.1:{server.getsockname()[1]}')
        assert may_ask(port)
        assert ask(port) == Answer('lidar', 'UST-20LX')
        answering.join()
    found = check_ports(port, Port('servo', '/dev/ttyUSB0'), ServoSettings())
    assert all(each.level < Level.WARNING for each in found), found


def test_a_tcp_address_where_nobody_listens_is_a_fault():
    port = port_facts('lidar', 'tcp://127.0.0.1:1')
    asked = replace(port, answer=ask(port))
    [found, _] = check_ports(asked, Port('servo', '/dev/ttyUSB0'), ServoSettings())
    assert (found.check, found.level) == ('no answer', Level.FAULT)
    assert 'USB' not in found.remedy
    assert 'probe --port tcp://127.0.0.1:1' in found.remedy


def test_a_link_and_where_it_leads_are_one_port(tmp_path):
    (tmp_path / 'ttyACM0').touch()
    (tmp_path / 'lidar').symlink_to(tmp_path / 'ttyACM0')
    assert same_port(str(tmp_path / 'lidar'), str(tmp_path / 'ttyACM0'))
    assert same_port(str(tmp_path / 'ttyACM0'), str(tmp_path / 'lidar'))
    assert not same_port(str(tmp_path / 'lidar'), str(tmp_path / 'ttyACM1'))
    assert not same_port('', str(tmp_path / 'lidar'))


def test_a_tcp_address_that_a_node_uses_is_not_asked():
    assert same_port('tcp://192.168.0.10', 'tcp://192.168.0.10:10940')
    assert not same_port('tcp://192.168.0.10', 'tcp://192.168.0.11')
    port = port_facts('lidar', 'tcp://192.168.0.10')
    assert may_ask(port)
    assert not may_ask(replace(port, own=True))
    assert may_ask(Port('lidar', '/dev/ttyACM0', own=True))

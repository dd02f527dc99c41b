"""Every status that an emulated URG-04LX can answer with, and how it gets there."""

from nodlidar_common import scip
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
import numpy as np
import pytest


class Talk:
    """Commands in, statuses out."""

    def __init__(self):
        measure = lambda times_ns, azimuth: np.ones(len(times_ns))  # noqa: E731
        self.urg = UrgEmulator(measure, start_ns=0)
        self.port = VirtualPort(self.urg, VirtualClock(), timeout=1.0)

    def __call__(self, command):
        self.port.write(command.encode() + b'\n')
        return self.next_status(command[:80])

    def next_status(self, echo=None):
        reply = b''
        while not reply.endswith(b'\n\n'):
            byte = self.port.read(1)
            assert byte, f'no end of {reply!r}'
            reply += byte
        lines = reply.split(b'\n')
        assert echo is None or lines[0] == echo.encode()
        return scip.strip_sum(lines[1]).decode()


@pytest.fixture
def talk():
    return Talk()


@pytest.mark.parametrize(
    ('dialogue', 'expected'),
    [
        ('VV PP II', '00 00 00'),
        ('BM BM QT QT BM', '00 02 00 00 00'),
        ('TM1 TM2 TM0 TM0 TM1 TM2 TM2', '04 03 00 02 00 00 03'),
        ('TM3 TMx', '01 01'),
        ('TM0 QT VV MD0044072501001 RS TM2 QT', '00 0E 0E 0E 0E 00 00'),
        ('BM TM0 TM2 GD0044072501', '00 00 00 10'),
        ('GD0044072501 GS0044072501 BM GD0044072501 GS0044072501', '10 10 00 00 00'),
        ('BM QT GD0044072501', '00 00 10'),
        ('BM RS GD0044072501', '00 00 10'),
        ('BM RT GD0044072501', '00 00 10'),
        ('MDx044072501001 MD0044x72501001 MD00440725x1001', '01 02 03'),
        ('MD0044076901001 MD0700069901001 MD004407250100x', '04 05 07'),
        ('MD0044072501x01 MS0044072501x01', '06 06'),
        ('MD0000076801001', '00'),
        ('GDx044072501 GD0044x72501 GD00440725x1 GD0044076901 GS0700069901', '01 02 03 04 05'),
        ('MD GD TM SS CR HS', '0C 0C 0C 0C 0C 0C'),
        ('MD0044 GD0044 SS1 CR1', '0F 0F 0F 0F'),
        ('X', '0D'),
        ('XX ME0044072501001 DB02 SCIP2.0 qt VV1 TM11', '0E 0E 0E 0E 0E 0E 0E'),
        ('VV;0123456789ABCDEF VV;0123456789ABCDEFG', '00 0G'),
        ('VV;ok VV; VV;a-b VV;a;b', '00 00 0H 0H'),
        ('SSx19200 SS012345 SS019200 SS115200 SS115200 RT SS115200 RS SS019200', None),
        ('CRxx CR11 CR00 CR05 CR05 CR99 CR99 CR01', '01 02 03 00 03 00 03 00'),
        ('HS0 HS1 HS1 HS2 HSx RS HS1', '02 00 02 01 01 00 00'),
    ],
)
def test_dialogues(talk, dialogue, expected):
    expected = expected or '01 02 03 00 03 00 03 00 03'
    assert [talk(command) for command in dialogue.split()] == expected.split()


def test_an_endless_line_is_too_much_for_the_buffer(talk):
    assert talk('Q' * 500) == '0B'
    assert talk('QT') == '00'


def test_statuses_that_only_a_fault_can_bring(talk):
    talk.urg.sensor.refuse_next(b'0A')
    assert [talk('QT'), talk('QT')] == ['0A', '00']


def test_firmware_update_mode_ends_with_a_reset(talk):
    talk.urg.sensor.firmware_update = True
    commands = ['VV', 'II', 'PP', 'QT', 'BM', 'MD0044072501001', 'RS', 'QT']
    assert [talk(c) for c in commands] == ['00', '00', '0I', '0I', '0I', '0I', '00', '00']


@pytest.mark.parametrize('verifying', [21, 30, 49])
def test_a_stream_that_stops_to_verify_and_resumes(talk, verifying):
    assert talk('MD0044072500000') == '00'
    assert talk.next_status() == '99'
    talk.urg.sensor.faults.come(verifying, verifying, 98)
    statuses = [talk.next_status() for _ in range(4)]
    assert statuses == [str(verifying)] * 2 + ['98', '99']


@pytest.mark.parametrize('fault', [50, 75, 97])
def test_a_hardware_fault_ends_the_stream_for_good(talk, fault):
    talk('MD0044072500000')
    talk.urg.sensor.faults.come(fault)
    assert talk.next_status('MD0044072500000') == str(fault)
    assert not talk.urg.sensor.laser
    assert talk.port.read(1) == b''
    commands = ['BM', 'GD0044072501', 'MD0044072500000']
    assert [talk(command) for command in commands] == ['01', str(fault), str(fault)]
    assert [talk('RS'), talk('BM')] == ['00', '00']

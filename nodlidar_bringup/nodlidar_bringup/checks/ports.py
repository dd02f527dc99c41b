"""Checks of the serial ports and of what answers there.

USB IDs: Hokuyo's 15d1:0000 is a CDC-ACM device, FTDI's 0403:6014 the chip of the U2D2, fff1:ff48
ROBOTIS' OpenCM and OpenCR, 16d0:06a7 the USB2AX. The USB2Dynamixel's 0403:6001 is that of any
FT232R, so it shows nothing.
"""

from dataclasses import dataclass
import os
import re

from nodlidar_bringup.checks.finding import fault, Finding, good, unknown, warning
from nodlidar_bringup.checks.graph import LAUNCH
from nodlidar_common.serial_port import TCP, TCP_PORT

LIDAR, SERVO = 'lidar', 'servo'
LIDAR_IDS = ('15d1:0000',)
SERVO_IDS = ('0403:6014', 'fff1:ff48', '16d0:06a7')
LONGEST_LATENCY = 1
"""Of a USB adapter's latency timer, without a warning [ms]."""

INSTALL_RULES = 'ros2 run nodlidar_bringup install_udev_rules'
_LAUNCH = f'{LAUNCH} hardware:=real'


@dataclass(frozen=True, slots=True)
class Answer:
    """What answered on a port.

    Attributes
    ----------
    device
        'lidar', 'servo', or empty if nothing answered.
    model
        What it calls itself.
    baud_rate
        Bit rate at which it answered [bit/s].
    servo_id
        The servo's ID.
    wrong_mode
        Why the servo cannot be sent to positions, empty if it can.
    streams
        Whether it sends without being asked: a lidar with a driver of its own.
    """

    device: str = ''
    model: str = ''
    baud_rate: int = 0
    servo_id: int = 0
    wrong_mode: str = ''
    streams: bool = False


@dataclass(frozen=True, slots=True)
class Port:
    """The port of a device.

    Attributes
    ----------
    device
        The device that should be there: 'lidar' or 'servo'.
    path
        Its device file, or ``tcp://ADDRESS:PORT``.
    chosen
        Whether the user named the path.
    own
        Whether a running node of the sensor uses the path, and so may have it open.
    exists, may_use
        Whether the file exists, and whether this user may read and write it.
    group
        Group of the file.
    target
        The file that the path leads to, without links.
    users
        Programs that have the port open, as 'name (process)'.
    usb_id
        Vendor and product of the USB device, as '15d1:0000'; empty if it is none.
    latency_timer
        Of a USB adapter [ms]; None without one.
    answer
        What answered; None if nobody asked.
    """

    device: str
    path: str
    chosen: bool = True
    own: bool = False
    exists: bool = True
    may_use: bool = True
    group: str = 'dialout'
    target: str = ''
    users: tuple[str, ...] = ()
    usb_id: str = ''
    latency_timer: int | None = None
    answer: Answer | None = None


@dataclass(frozen=True)
class ServoSettings:
    """What the servo's node expects: bit rate [bit/s] and ID."""

    baud_rate: int = 1_000_000
    servo_id: int = 1


def same_port(one: str, other: str) -> bool:
    """Return whether two paths name one port, as a link and where it leads."""
    names = {
        name if name.startswith(TCP) else os.path.realpath(name)
        for name in map(_with_number, (one, other))
    }
    return len(names) == 1


def _with_number(path: str) -> str:
    return f'{path}:{TCP_PORT}' if re.fullmatch(f'{TCP}[^:]*', path) else path


def may_ask(port: Port) -> bool:
    """Return whether a device may be asked: nobody uses its port.

    Who is connected to a TCP address shows by the settings of the nodes only.
    """
    used = port.users or (port.own and port.path.startswith(TCP))
    return port.exists and port.may_use and not used


def check_ports(lidar: Port | None, servo: Port | None, settings: ServoSettings) -> list[Finding]:
    """Return what is wrong with the ports.

    Parameters
    ----------
    lidar, servo
        The ports; None for a device that a node of others drives.
    settings
        What the servo's node expects.
    """
    if lidar is None:
        return [] if servo is None else [*_check_port(servo), *_check_servo(servo, settings)]
    if servo is None:
        return _check_port(lidar)
    if (
        lidar.exists
        and servo.exists
        and (lidar.target or lidar.path) == (servo.target or servo.path)
    ):
        text = f"lidar and servo have the same port, '{lidar.path}'"
        return [fault('one port for both', text, f'{_LAUNCH} lidar_port:=... servo_port:=...')]
    if _swapped(lidar, servo):
        text = f"the servo is at '{lidar.path}' and the lidar at '{servo.path}'"
        own = servo.answer is not None and servo.answer.streams  # a driver of its own
        where = 'lidar:=...' if own else f'lidar_port:={servo.path}'
        remedy = f'{_LAUNCH} {where} servo_port:={lidar.path}'
        return [fault('ports swapped', text, remedy)]
    return [*_check_port(lidar), *_check_port(servo), *_check_servo(servo, settings)]


def _swapped(lidar: Port, servo: Port) -> bool:
    """Return whether each port shows the other device, or one does and the other is silent."""
    shown = _shown(lidar), _shown(servo)
    return shown in {(SERVO, LIDAR), (SERVO, ''), ('', LIDAR)}


def _shown(port: Port) -> str:
    """Return the device that a port shows, by its answer or else by its USB ID."""
    if port.answer and port.answer.device:
        return port.answer.device
    known = dict.fromkeys(LIDAR_IDS, LIDAR) | dict.fromkeys(SERVO_IDS, SERVO)
    return known.get(port.usb_id, '')


def _check_port(port: Port) -> list[Finding]:
    name = f"the {port.device}'s port '{port.path}'"
    if not port.exists:
        remedy = (
            f'plug it in, see `ls -l /dev/serial/by-id`, then {_LAUNCH} {port.device}_port:=...'
        )
        found = fault if port.chosen else unknown
        return [found('port missing', f'{name} does not exist', remedy)]
    if not port.may_use:
        remedy = f'sudo usermod -aG {port.group} $USER, then log out and in again'
        return [fault('no rights', f'{name} may not be used by this user', remedy)]
    if port.users and not port.own:
        text = f'{name} is in use by {", ".join(port.users)}'
        return [fault('port in use', text, f'end that program: `fuser -v {port.path}` shows it')]
    return [*_check_latency(port, name), *_check_answer(port, name)]


def _check_latency(port: Port, name: str) -> list[Finding]:
    if port.latency_timer is None or port.latency_timer <= LONGEST_LATENCY:
        return []
    text = f'the adapter at {name} holds replies back for up to {port.latency_timer} ms'
    return [warning('latency timer', text, INSTALL_RULES)]


def _check_answer(port: Port, name: str) -> list[Finding]:
    if port.answer is None:
        if port.users:
            return [good('port', f'{name} is open in {", ".join(port.users)}')]
        return [unknown('port', f'{name} may be used; no device was asked for an answer')]
    if not port.answer.device:
        return [fault('no answer', f'nothing answers at {name}', _to_wake(port))]
    if port.answer.streams:
        return [_check_stream(port, name)]
    if port.answer.device != port.device:
        text = f'at {name} answers a {port.answer.device}'
        return [fault('wrong device', text, f'{_LAUNCH} {port.device}_port:=...')]
    return [good('port', f'at {name} answers {port.answer.model}')]


def _check_stream(port: Port, name: str) -> Finding:
    text = f'something streams at {name}, such as an LD19'
    if port.device == LIDAR:
        return good('port', f'{text}, which lidar:=LD19 reads')
    remedy = f'{_LAUNCH} lidar:=... servo_port:=... (`ls -l /dev/serial/by-id` shows which)'
    return fault('wrong device', text, remedy)


def _to_wake(port: Port) -> str:
    """Return what may bring a silent device to answer."""
    if port.device == SERVO:
        return (
            "check the servo's supply (its LED blinks at power-on) and the cable, then find it at"
            f' any bit rate: {_setup(port)}'
        )
    if port.path.startswith(TCP):
        remedy = (
            'check supply, network cable and address of the lidar, end other programs that use it'
        )
    else:
        remedy = 'pull the USB cable of the lidar out and plug it in (5 V, 0.5 A)'
    return f'{remedy}; then ros2 run nodlidar_driver probe --port {port.path}'


def _check_servo(port: Port, settings: ServoSettings) -> list[Finding]:
    answer = port.answer
    if answer is None or answer.device != SERVO:
        return []
    findings = []
    if answer.baud_rate != settings.baud_rate:
        text = f'the servo talks at {answer.baud_rate} bit/s, its node at {settings.baud_rate}'
        findings.append(fault('wrong bit rate', text, _setup(port)))
    if answer.servo_id != settings.servo_id:
        text = f'the servo has the ID {answer.servo_id}, its node asks for {settings.servo_id}'
        findings.append(fault('wrong ID', text, _setup(port)))
    if answer.wrong_mode:
        text = f'the servo cannot nod, it is {answer.wrong_mode}'
        findings.append(fault('wheel mode', text, _setup(port)))
    return findings


def _setup(port: Port) -> str:
    return f'ros2 run nodlidar_servo setup --port {port.path}'

"""Finds a servo, shows what it is, and sets it up for the servo node.

It asks before each change, writes with the torque off, reads back, and ends with the command that
starts the nod. It never moves the motor. What the file for the node's parameters already says,
and no option does, stays.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
import re
import shlex
from typing import Any

from nodlidar_common.command_line import LineParser
from nodlidar_common.parameter_file import file_values, read_parameters
from nodlidar_common.serial_port import close_port, open_port, port_errors, SerialPort
from nodlidar_common.terminal import progress_bar
from nodlidar_common.whole_file import check_writable, whole_file
from nodlidar_servo.bus.latency import latency_timer
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.models.models import MODELS
from nodlidar_servo.setup.dialogue import Dialogue, Result, Wish
from nodlidar_servo.setup.errors import LidarError, NoServoError
from rich.console import Console
from rich.table import Table
import yaml

_LAUNCH = 'ros2 launch nodlidar_bringup robot.launch.py hardware:=real'
_LIDAR_RATE, _LIDAR_WAIT = 115_200, 0.4  # s; a lidar answers once a revolution
_DEFAULTS = ServoConfig()
_ANY_NODE = '/**'
# Parameters of the node that depend on the servo and its mount, and so on what is set up.
_PARAMETERS = (
    'baud_rate',
    'servo_id',
    'invert',
    'zero_tick',
    'pitch_lower_limit',
    'pitch_upper_limit',
)


def main(argv: Sequence[str] | None) -> None:
    """Set the servo up that a command line names, as far as the user agrees.

    Raises
    ------
    DeviceError, PortError, ParameterError
        See `Dialogue.set_up`.
    OSError
        If the parameter file cannot be written.
    """
    options = _parse(argv)
    if not options.dry_run:
        check_writable(Path(options.output))
    port = Port(options.port)
    _warn_of_latency(port)
    try:
        result = _with_progress(port, options)
    except NoServoError as error:
        check_lidar(port)
        raise error from None
    _show_changes(result)
    _show_start(result, options)


class Port:
    """The servo's port, opened anew at each bit rate."""

    def __init__(self, path: str) -> None:
        self.path = path

    @contextmanager
    def __call__(self, baud_rate: int) -> Iterator[SerialPort]:
        """Open the port at a bit rate [bit/s]."""
        port = open_port(self.path, baud_rate, None)
        try:
            yield port
        finally:
            close_port(port)


def start_command(port: str, config: ServoConfig, file: Path | None) -> str:
    """Return the command that starts the nod.

    Parameters
    ----------
    port
        The servo's port.
    config
        What the node must be given.
    file
        Its parameter file, None if the defaults do.
    """
    words = [_LAUNCH, f'servo:={config.model}', f'servo_port:={shlex.quote(port)}']
    return ' '.join([*words, *([f'servo_params:={shlex.quote(str(file))}'] if file else [])])


def node_parameters(config: ServoConfig) -> dict[str, object]:
    """Return the parameters of the node that are not its defaults, without model and port."""
    return {
        name: getattr(config, name)
        for name in _PARAMETERS
        if getattr(config, name) != getattr(_DEFAULTS, name)
    }


def parameter_file(
    parameters: Mapping[str, object], before: Mapping[str, Mapping[str, object]]
) -> str:
    """Return the text of a YAML file with parameters of the node; empty if it needs none.

    Parameters
    ----------
    parameters
        Those that were set up, without the defaults.
    before
        The sections of the file as it was. What is not set up here stays.
    """
    others = {
        section: {name: value for name, value in values.items() if name not in _PARAMETERS}
        for section, values in before.items()
    }
    sections = {_ANY_NODE: {**parameters, **others.pop(_ANY_NODE, {})}, **others}
    filled = {name: {'ros__parameters': values} for name, values in sections.items() if values}
    return yaml.safe_dump(filled, sort_keys=False) if filled else ''


def _with_progress(port: Port, options: argparse.Namespace) -> Result:
    with progress_bar() as progress:
        task = progress.add_task('looking for a servo')

        def tried(done: int, of: int) -> None:
            progress.update(task, completed=done, total=of)

        def agrees(question: str) -> bool:
            progress.stop()  # it would redraw the line of the answer
            return bool(options.yes) or _agrees(question)

        dialogue = Dialogue(port, agrees, print, tried)
        return dialogue.set_up(_wish(options))


def _wish(options: argparse.Namespace) -> Wish:
    known: dict[str, Any] = {}
    if Path(options.output).exists():
        known = file_values([options.output], 'servo', ServoConfig)
    low, high = options.limits or (None, None)
    chosen = {
        'baud_rate': options.baud_rate,
        'servo_id': options.servo_id,
        'invert': options.invert,
        'pitch_lower_limit': low,
        'pitch_upper_limit': high,
    }
    values = {name: known[name] for name in _PARAMETERS if name in known}
    values |= {name: value for name, value in chosen.items() if value is not None}
    config = ServoConfig(port=options.port, **values)
    level = True if options.level else False if options.yes else None
    return Wish(config, options.model, options.from_id, level, options.dry_run)


def _agrees(question: str) -> bool:
    """Ask on the terminal; no answer is no consent."""
    try:
        return input(f'{question}? [y/N] ').strip().lower() in ('y', 'yes')
    except EOFError:
        print('no answer: left as it is; --yes agrees to all but the zero')
        return False


def _warn_of_latency(port: Port) -> None:
    latency = latency_timer(port.path)
    if latency is not None and latency > 1:
        print(
            f'WRONG: the adapter holds replies back for up to {latency} ms:'
            ' ros2 run nodlidar_bringup install_udev_rules'
        )


def check_lidar(port: Port) -> None:
    """Raise LidarError if a lidar answers at the servo's port."""
    with port(_LIDAR_RATE) as stream, port_errors():
        stream.reset_input_buffer()
        stream.timeout = _LIDAR_WAIT
        stream.write(b'\nQT\nVV\n')
        reply = stream.read(400)
    if re.search(rb'PROD:|QT\n', reply):
        raise LidarError(
            f"a lidar answers at '{port.path}': swap the ports, --port is that of the servo"
            ' (`ls -l /dev/serial/by-id` shows which)'
        )


def _show_changes(result: Result) -> None:
    if not result.changes:
        print('nothing was changed')
        return
    table = Table('register', 'before', 'after', 'why', title='changed, and read back')
    for change in result.changes:
        after = result.after.values[change.name]
        before = 'unknown' if change.before is None else str(change.before)
        table.add_row(change.name, before, str(after), change.reason)
    Console().print(table)


def _show_start(result: Result, options: argparse.Namespace) -> None:
    """Write the node's parameters if they are not its defaults; show what starts the nod."""
    parameters, file = node_parameters(result.config), None
    if options.dry_run:
        needed = ', '.join(f'{key}: {value}' for key, value in parameters.items())
        print(f'parameters that the node would need: {needed or "none"}')
        return
    path = Path(options.output).absolute()
    before = read_parameters(path) if path.exists() else {}
    text = parameter_file(parameters, before)
    if text or before:
        with whole_file(path) as part:
            part.write_text(text)
    if text:
        file = path
        print(f"parameters of the node: '{file}'")
    if result.after.faults():
        print('still wrong: ' + '; '.join(result.after.faults()))
    print(
        'This starts the nod, the motor moves. Add lidar_port:=..., and lidar:=... without a'
        ' Hokuyo (docs/lidars.md):'
    )
    print(start_command(options.port, result.config, file))


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('setup', __doc__)
    limits = _DEFAULTS.pitch_lower_limit, _DEFAULTS.pitch_upper_limit
    parser.add_argument('--port', default=_DEFAULTS.port, help='port of the servo')
    parser.add_argument('--model', default='', choices=MODELS, help='refuse any other model')
    parser.add_argument(
        '--from-id', type=int, metavar='ID', help='of several servos, the one with this ID'
    )
    parser.add_argument('--servo-id', type=int, help=f'ID to set [default: {_DEFAULTS.servo_id}]')
    parser.add_argument(
        '--baud-rate', type=int, help=f'bit rate to set [default: {_DEFAULTS.baud_rate}]'
    )
    parser.add_argument(
        '--limits',
        type=float,
        nargs=2,
        metavar=('LOW', 'HIGH'),
        help='pitches that the mount allows [rad] [default: {:g} {:g}]'.format(*limits),
    )
    parser.add_argument(
        '--invert',
        action=argparse.BooleanOptionalAction,
        help='the beams go down as the position of the servo rises [default: no]',
    )
    parser.add_argument(
        '--level', action='store_true', help='the scan plane is level now: make this the zero'
    )
    parser.add_argument('--yes', action='store_true', help='agree to all changes but the zero')
    parser.add_argument('--dry-run', action='store_true', help='change nothing')
    parser.add_argument(
        '--output',
        default='servo.yaml',
        help="file for the node's parameters, if needed; what it already says is the default",
    )
    return parser.parse_args(argv)

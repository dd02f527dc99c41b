"""Shows what a lidar is, how fast it scans, how well it is dated, and what it sees.

It reads some seconds of scans. The laser of a Hokuyo is off afterwards, also after Ctrl-C or an
error; an LD06 or LD19 takes no commands.
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
import json
import math
import sys

from nodlidar_common.command_line import LineParser
from nodlidar_common.errors import DeviceError, ParameterError, PortError
from nodlidar_common.guard import Guard
from nodlidar_common.host_time import raw_ns
from nodlidar_common.ldrobot import LD19
from nodlidar_common.serial_port import close_port, open_port, OpenPort
from nodlidar_driver.base.reader import READ_TIMEOUT, Reader, SilenceError
from nodlidar_driver.config import LdrobotConfig, ScipConfig
from nodlidar_driver.ldrobot.lidar import LdrobotLidar
from nodlidar_driver.probing import Identity, NoLidarError, Probe, probe_ldrobot, probe_scip
from nodlidar_driver.scan_picture import picture
from nodlidar_driver.scip.lidar import Lidar
from nodlidar_driver.scip.scan_account import ScanAccount
from nodlidar_driver.scip.scip_answer import STOP
from nodlidar_driver.scip.scip_port import ScipPort
import numpy as np
from rich.console import Console
from rich.table import Table

_HOKUYO = 'Hokuyo'
_DEFAULTS: dict[str, ScipConfig | LdrobotConfig] = {
    _HOKUYO: ScipConfig(),
    LD19: LdrobotConfig(),
}
_WIDTH, _HEIGHT = 79, 24  # characters of the picture
_LONGEST = 3600.0  # s


def main(argv: Sequence[str] | None) -> None:
    """Probe the lidar that a command line names, and show what was found.

    Raises
    ------
    DeviceError, PortError, StoppedError
        If there is no such lidar, or it fails.
    ParameterError
        For an option that is not allowed.
    """
    options = _parse(argv)
    if not 0.0 < options.seconds <= _LONGEST:
        limit = f'above 0 and at most {_LONGEST} s'
        raise ParameterError('--seconds', limit, options.seconds)
    with _opened(options) as port:
        found = _probed(port, options)
    if options.json:
        print(json.dumps(found.numbers(), indent=2))
    else:
        _show(found)


@contextmanager
def _opened(options: argparse.Namespace) -> Iterator[OpenPort]:
    """Yield the port, open."""
    defaults = _DEFAULTS[options.lidar]
    baud_rate = options.baud_rate or defaults.baud_rate
    port = open_port(options.port or defaults.port, baud_rate, READ_TIMEOUT)
    try:
        yield port
    finally:
        close_port(port)


def _probed(port: OpenPort, options: argparse.Namespace) -> Probe:
    if options.lidar == LD19:
        config = LdrobotConfig()
        reader = Reader(port, raw_ns, config.timeout)
        window = config.angle_min, config.angle_max
        lidar = LdrobotLidar(reader, window, config.least_confidence)
        with _no_lidar(SilenceError, 'no LD06 or LD19 sends'):
            lidar.connect()
        return probe_ldrobot(lidar, options.seconds)
    account = ScanAccount()
    with _streaming(port, account) as hokuyo:
        return probe_scip(hokuyo, account, options.seconds)


@contextmanager
def _streaming(port: OpenPort, account: ScanAccount) -> Iterator[Lidar]:
    """Yield a Hokuyo that streams; its laser is off afterwards, whatever happens."""
    config = ScipConfig()
    lidar = Lidar(ScipPort(port, raw_ns, config.timeout), config.window, account)
    with _no_lidar(DeviceError, 'no lidar of SCIP 2.0 answers (LD06, LD19: --lidar LD19)'):
        lidar.client.start_session()
    with _switched_off(lidar, Guard(port.fileno(), STOP)):
        lidar.connect()
        yield lidar


@contextmanager
def _switched_off(lidar: Lidar, guard: Guard) -> Iterator[None]:
    """Turn the laser off at the end; the guard does if that fails or the process is killed."""
    try:
        yield
    except BaseException:
        with suppress(DeviceError):
            lidar.disconnect()
        guard.trigger()
        raise
    try:
        lidar.disconnect()
    except DeviceError:
        guard.trigger()
        raise
    guard.dismiss()


@contextmanager
def _no_lidar(failure: type[DeviceError], text: str) -> Iterator[None]:
    """Raise NoLidarError with a text instead of a failure; errors of the port stay."""
    try:
        yield
    except PortError:
        raise
    except failure as error:
        raise NoLidarError(
            f'{text}: {error}; `ros2 run nodlidar_bringup doctor` examines the ports'
        ) from error


def _show(found: Probe) -> None:
    console = Console(highlight=False)
    table = Table(show_header=False, box=None)
    for name, text in lines(found):
        table.add_row(name, text)
    console.print(table)
    near = np.isfinite(found.ranges)
    directions = np.stack((np.cos(found.azimuths), np.sin(found.azimuths)), axis=1)
    points = directions[near] * found.ranges[near, None]
    braille = 'utf' in (sys.stdout.encoding or '').lower()
    drawn, line = picture(points, _WIDTH, _HEIGHT, braille)
    print(f'\nThe last scan from above: forward is up, a line is {line:.2f} m, + is the lidar')
    print('\n'.join(drawn))
    for warning in found.warnings:
        print(f'WARNING: {warning}')


def lines(found: Probe) -> list[tuple[str, str]]:
    """Return names and values of what was found, in words and with units."""
    clock = found.clock
    lost = ', '.join(f'{count} {reason.lower()}' for reason, count in found.lost.items()) or 'none'
    least, greatest = found.limits
    said = _identity(found.identity) if found.identity else [('lidar', 'LD06 or LD19, LDROBOT')]
    measured = [
        ('azimuths', f'{least:.4f} to {greatest:.4f} rad'),
        ('rate', f'{found.rate:.3f} Hz, nominal {found.nominal_rate:g} Hz'),
        ('scans', f'{found.scans}; lost: {lost}'),
        (
            'echoes',
            f'{found.seen:.1%} in range, {found.nothing:.1%} nothing,'
            f' {found.too_near:.1%} too near, {found.doubtful:.1%} doubtful',
        ),
        ('clock', _clock(found)),
        ('drift', f'{clock.drift_ppm:+.1f} ppm'),
        ('fit residual', f'{clock.residual * 1e3:.3f} ms RMS of the stamps'),
        ('jitter', f'{clock.jitter * 1e3:.3f} ms on average, latest {clock.latest * 1e3:.1f} ms'),
        ('latency', f'{clock.latency * 1e3:.1f} ms from the first beam to the arrival'),
    ]
    if found.uneven is not None:
        measured.append(('uneven motor', f'{math.degrees(found.uneven):.2f} deg at most'))
    return [*said, ('beams', f'{len(found.ranges)} in the last scan'), *measured]


def _clock(found: Probe) -> str:
    if found.identity is None:
        return 'timer of its packets, offset by the earliest arrivals'
    return 'answers in time mode' if found.clock.synchronised else 'no time mode: offset assumed'


def _identity(identity: Identity) -> list[tuple[str, str]]:
    version, lidar, state = identity.version, identity.capabilities, identity.state
    return [
        ('lidar', f'{version.product}, {version.vendor}'),
        ('model', lidar.model),
        ('firmware', f'{version.firmware}, {version.protocol}'),
        ('serial number', version.serial_number),
        ('health', state.health),
        ('motor', state.speed),
        ('steps', f'{lidar.steps_per_revolution} per revolution'),
        ('ranges', f'{lidar.range_min:g} to {lidar.range_max:g} m'),
    ]


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('probe', __doc__)
    ports = ', '.join(f'{each.port} of {name}' for name, each in _DEFAULTS.items())
    parser.add_argument('--lidar', choices=_DEFAULTS, default=_HOKUYO, help='LD19 is an LD06, too')
    parser.add_argument(
        '--port', help=f'serial port, or tcp://ADDRESS[:PORT] of a Hokuyo [default: {ports}]'
    )
    parser.add_argument('--baud-rate', type=int, help='bit rate of a port that is not USB')
    parser.add_argument('--seconds', type=float, default=5.0, help='how long to read scans [s]')
    parser.add_argument('--json', action='store_true', help='print numbers, in SI units')
    return parser.parse_args(argv)

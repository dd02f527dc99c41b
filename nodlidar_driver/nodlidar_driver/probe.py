"""The command `probe`: what a lidar is, how fast it scans, how well it is dated, what it sees.

It reads some seconds of scans and leaves the laser off, also after Ctrl-C or an error.
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
import json
import sys

from nodlidar_common.command_line import LineParser, run
from nodlidar_common.errors import DeviceError, ParameterError, PortError
from nodlidar_common.guard import Guard
from nodlidar_common.host_time import even_ns
from nodlidar_common.reader import READ_TIMEOUT
from nodlidar_common.serial_port import close_port, open_port
from nodlidar_driver.config import DriverConfig
from nodlidar_driver.lidar import Lidar
from nodlidar_driver.probing import NoLidarError, Probe, probe
from nodlidar_driver.scan_picture import picture
from nodlidar_driver.scip.scan_account import ScanAccount
from nodlidar_driver.scip.scip_answer import STOP
import numpy as np

_DEFAULTS = DriverConfig()
_WIDTH, _HEIGHT = 79, 24  # characters of the picture
_LONGEST = 3600.0  # s


def main(argv: Sequence[str] | None = None) -> int:
    """Probe a lidar; return the exit status."""

    def work() -> None:
        options = _parse(argv)
        if not 0.0 < options.seconds <= _LONGEST:
            limit = f'above 0 and at most {_LONGEST} s'
            raise ParameterError('--seconds', limit, options.seconds)
        account = ScanAccount()
        with _connected(options, account) as lidar:
            found = probe(lidar, account, options.seconds)
        if options.json:
            print(json.dumps(found.numbers(), indent=2))
        else:
            _show(found)

    return run('probe', work)


@contextmanager
def _connected(options: argparse.Namespace, account: ScanAccount) -> Iterator[Lidar]:
    """Yield a lidar that streams; its laser is off afterwards, whatever happens."""
    port = open_port(options.port, options.baud_rate, READ_TIMEOUT)
    try:
        lidar = Lidar(port, _DEFAULTS.window, even_ns, _DEFAULTS.timeout, account)
        _check_lidar(lidar, options.port)
        with _switched_off(lidar, Guard(port.fileno(), STOP)):
            lidar.connect()
            yield lidar
    finally:
        close_port(port)


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


def _check_lidar(lidar: Lidar, port: str) -> None:
    """Raise NoLidarError if no lidar answers."""
    try:
        lidar.client.start_session()
    except PortError:
        raise
    except DeviceError as error:
        raise NoLidarError(
            f"no lidar of SCIP 2.0 answers at '{port}': {error};"
            ' `ros2 run nodlidar_bringup doctor` examines the ports'
        ) from error


def _show(found: Probe) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    table = Table(show_header=False, box=None)
    for name, text in lines(found):
        table.add_row(name, text)
    console.print(table)
    azimuth = found.window.angle_min + found.window.angle_increment * np.arange(found.window.count)
    near = np.isfinite(found.ranges)
    points = np.stack((np.cos(azimuth), np.sin(azimuth)), axis=1)[near] * found.ranges[near, None]
    braille = 'utf' in (sys.stdout.encoding or '').lower()
    drawn, line = picture(points, _WIDTH, _HEIGHT, braille)
    print(f'\nThe last scan from above: forward is up, a line is {line:.2f} m, + is the lidar')
    print('\n'.join(drawn))
    for warning in found.warnings:
        print(f'WARNING: {warning}')


def lines(found: Probe) -> list[tuple[str, str]]:
    """Return names and values of what was found, in words and with units."""
    lidar, clock = found.capabilities, found.clock
    lost = ', '.join(f'{count} {reason}' for reason, count in found.lost.items()) or 'none'
    window = found.window
    return [
        ('lidar', f'{found.version.product}, {found.version.vendor}'),
        ('model', lidar.model),
        ('firmware', f'{found.version.firmware}, {found.version.protocol}'),
        ('serial number', found.version.serial_number),
        ('health', found.state.health),
        ('motor', found.state.speed),
        ('beams', f'{window.count} of {lidar.steps_per_revolution} steps'),
        ('azimuths', f'{window.angle_min:.4f} to {window.angle_max:.4f} rad'),
        ('ranges', f'{lidar.range_min:g} to {lidar.range_max:g} m'),
        ('rate', f'{found.rate:.3f} Hz, nominal {found.nominal_rate:g} Hz'),
        ('scans', f'{found.scans}; lost: {lost}'),
        (
            'echoes',
            f'{found.seen:.1%} in range, {found.nothing:.1%} nothing,'
            f' {found.too_near:.1%} too near, {found.doubtful:.1%} doubtful',
        ),
        (
            'clock',
            'answers in time mode' if clock.synchronised else 'no time mode: offset assumed',
        ),
        ('drift', f'{clock.drift_ppm:+.1f} ppm'),
        ('fit residual', f'{clock.residual * 1e3:.3f} ms RMS of the stamps'),
        ('jitter', f'{clock.jitter * 1e3:.3f} ms on average, latest {clock.latest * 1e3:.1f} ms'),
        ('latency', f'{clock.latency * 1e3:.1f} ms from the first beam to the arrival'),
    ]


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('probe', __doc__)
    parser.add_argument(
        '--port', default=_DEFAULTS.port, help='serial port, or tcp://ADDRESS[:PORT]'
    )
    parser.add_argument('--baud-rate', type=int, default=_DEFAULTS.baud_rate, help='of RS-232')
    parser.add_argument('--seconds', type=float, default=5.0, help='how long to read scans')
    parser.add_argument('--json', action='store_true', help='print numbers, in SI units')
    return parser.parse_args(argv)


if __name__ == '__main__':
    sys.exit(main())

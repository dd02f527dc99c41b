"""Installs rules of udev: ports with names that stay, rights and a short latency."""

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import shlex
import subprocess

from nodlidar_common.command_line import LineParser
from nodlidar_common.errors import NodlidarError

TARGET = '/etc/udev/rules.d/60-nodlidar.rules'


def main(argv: Sequence[str] | None) -> None:
    """Install the rules, or print them."""
    from nodlidar_bringup.ros.shared_files import share

    rules = Path(share('nodlidar_bringup', 'config/udev/60-nodlidar.rules'))
    if _parse(argv).print:
        print(rules.read_text(), end='')
    else:
        install(rules, as_root=os.geteuid() == 0)


def commands(rules: Path, *, as_root: bool) -> list[list[str]]:
    """Return the commands that install a file of rules, and apply it to what is plugged in.

    Parameters
    ----------
    rules
        The file.
    as_root
        Whether sudo is not needed.
    """
    sudo = [] if as_root else ['sudo']
    return [
        [*sudo, 'install', '-m', '644', str(rules), TARGET],
        [*sudo, 'udevadm', 'control', '--reload'],
        [
            *(*sudo, 'udevadm', 'trigger', '--action=add'),
            *('--subsystem-match=tty', '--subsystem-match=usb-serial'),
        ],
    ]


def install(rules: Path, *, as_root: bool) -> None:
    """Run the commands, each after it is shown.

    Raises
    ------
    NodlidarError
        If one of them fails.
    """
    state = 'the rules are not installed'
    for command in commands(rules, as_root=as_root):
        print(shlex.join(command), flush=True)
        try:
            subprocess.run(command, check=True)
        except (OSError, subprocess.CalledProcessError) as error:
            raise NodlidarError(f'{state}: {error}') from error
        state = 'the rules are installed, but in effect only after a restart'
    print('done: /dev/nodlidar_lidar and /dev/nodlidar_servo appear when the devices are there')


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('install_udev_rules', __doc__)
    parser.add_argument('--print', action='store_true', help='print the rules, change nothing')
    return parser.parse_args(argv)

"""Reads what the system says about a serial port."""

import grp
import os
from pathlib import Path

from nodlidar_bringup.checks.ports import Port
from nodlidar_common.serial_port import TCP
from nodlidar_servo.bus.latency import latency_timer, TTY_CLASS

PROCESSES = Path('/proc')


def port_facts(device: str, path: str, tty_class: Path = TTY_CLASS) -> Port:
    """Return what the system says about a port, without opening it.

    Parameters
    ----------
    device, path
        The device that should be there, and its device file or ``tcp://ADDRESS:PORT``.
    tty_class
        Folder in which the system describes serial ports.
    """
    if path.startswith(TCP):
        return Port(device, path)
    target = os.path.realpath(path)
    if not os.path.exists(target):
        return Port(device, path, exists=False, target=target)
    return Port(
        device,
        path,
        may_use=os.access(target, os.R_OK | os.W_OK),
        group=_group(target),
        target=target,
        users=_users(target),
        usb_id=_usb_id(tty_class / os.path.basename(target) / 'device'),
        latency_timer=latency_timer(target, tty_class),
    )


def _group(path: str) -> str:
    number = os.stat(path).st_gid
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)


def _users(target: str) -> tuple[str, ...]:
    """Return the programs that have a file open, as far as this user may see them."""
    users = []
    for folder in PROCESSES.glob('[0-9]*'):
        try:
            if any(_leads_to(file, target) for file in (folder / 'fd').iterdir()):
                users.append(f'{_program(folder)} (process {folder.name})')
        except OSError:  # of another user, or ended
            continue
    return tuple(sorted(users))


def _leads_to(open_file: Path, target: str) -> bool:
    try:
        return os.readlink(open_file) == target
    except FileNotFoundError:  # closed since it was listed: the others count
        return False


def _program(folder: Path) -> str:
    """Return the name of a process: of a script, that of its file, not of its interpreter."""
    words = (folder / 'cmdline').read_bytes().decode(errors='replace').split('\0')
    names = [os.path.basename(word) for word in words if word and not word.startswith('-')]
    return next((name for name in names if not name.startswith('python')), 'a program')


def _usb_id(described: Path) -> str:
    """Return vendor and product of the nearest USB device above, empty if there is none."""
    here = described.resolve()
    for folder in (here, *here.parents[:4]):
        try:
            vendor, product = (
                (folder / name).read_text().strip() for name in ('idVendor', 'idProduct')
            )
        except OSError:
            continue
        return f'{vendor}:{product}'
    return ''

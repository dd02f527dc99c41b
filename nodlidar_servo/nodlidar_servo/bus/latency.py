"""The latency timer of USB serial adapters: how long they hold a reply back."""

from pathlib import Path

from nodlidar_common.serial_port import OpenPort, port_errors
from nodlidar_common.tcp_port import TcpPort

TTY_CLASS = Path('/sys/class/tty')


def latency_timer(port: str, tty_class: Path = TTY_CLASS) -> int | None:
    """Return how long the adapter of a port holds replies back [ms]; None if that is unknown.

    Parameters
    ----------
    port
        The device file.
    tty_class
        Folder in which the system describes its serial ports.
    """
    try:
        return int(_file(port, tty_class).read_text())
    except (OSError, ValueError):
        return None


def reduce_latency(port: OpenPort, tty_class: Path = TTY_CLASS) -> str:
    """Set a port's adapter to its shortest latency; return a warning, empty on success.

    Setting the low-latency flag needs access to the port only, writing the file in sysfs more.
    A port without a latency timer (no FTDI adapter, a pseudo-terminal) is left unchanged.

    Parameters
    ----------
    port
        The open port.
    tty_class
        Folder in which the system describes its serial ports.

    Raises
    ------
    PortError
        If the adapter is unplugged meanwhile.
    """
    timer = _file(str(port.port), tty_class)
    if isinstance(port, TcpPort) or not timer.exists() or _read(timer) <= 1:
        return ''
    for attempt in (lambda: port.set_low_latency_mode(True), lambda: timer.write_text('1\n')):
        try:
            attempt()
        except (OSError, ValueError):
            continue
        if _read(timer) <= 1:
            return ''
    return (
        f"the adapter of '{port.port}' holds replies back for up to {_read(timer)} ms, and this"
        ' could not be changed; for the full rate of joint states run'
        ' `ros2 run nodlidar_bringup install_udev_rules`'
    )


def _file(port: str, tty_class: Path) -> Path:
    return tty_class / Path(port).resolve().name / 'device' / 'latency_timer'


def _read(timer: Path) -> int:
    with port_errors():
        return int(timer.read_text())

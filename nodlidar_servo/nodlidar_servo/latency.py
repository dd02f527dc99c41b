"""The latency timer of USB serial adapters: how long they keep a reply before they pass it on."""

from pathlib import Path

from nodlidar_common.serial_port import port_errors
import serial

TTY_CLASS = Path('/sys/class/tty')
UDEV_RULE = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'


def reduce_latency(port: serial.Serial, tty_class: Path = TTY_CLASS) -> str:
    """Ask a port's adapter for its shortest latency; return a warning, empty if all is well.

    The low-latency flag of the port needs no rights beyond the port's own, the file in sysfs does.
    A port without a latency timer (no FTDI adapter, a pseudo-terminal) is left alone.

    Parameters
    ----------
    port
        The open port.
    tty_class
        Where the system describes its serial ports.

    Raises
    ------
    PortError
        If the adapter goes away meanwhile.
    """
    timer = tty_class / Path(str(port.port)).resolve().name / 'device' / 'latency_timer'
    if not timer.exists() or _read(timer) <= 1:
        return ''
    for attempt in (lambda: port.set_low_latency_mode(True), lambda: timer.write_text('1\n')):
        try:
            attempt()
        except (OSError, ValueError):
            continue
        if _read(timer) <= 1:
            return ''
    return (
        f"the adapter of '{port.port}' keeps replies for up to {_read(timer)} ms and could not be"
        f' told otherwise; for the full rate of joint states add this udev rule: {UDEV_RULE}'
    )


def _read(timer: Path) -> int:
    with port_errors():
        return int(timer.read_text())

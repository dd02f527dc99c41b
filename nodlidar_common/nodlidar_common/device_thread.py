"""The thread that keeps a serial device connected."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
import termios
import threading
import traceback
from typing import Any, Protocol

from nodlidar_common.errors import DeviceError
from nodlidar_common.guard import Guard, StopRequest
from nodlidar_common.serial_port import close_port, open_port, OpenPort


class Device(Protocol):
    """The steps that the thread repeats; see :class:`.DeviceNode`."""

    config: Any

    def connect(self) -> None: ...  # noqa: D102
    def cycle(self) -> None: ...  # noqa: D102
    def disconnect(self) -> None: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Connection:
    """State of the connection, and how many connections were made so far."""

    message: str = 'not connected: the node is not active'
    is_failed: bool = False
    count: int = 0


class DeviceThread:
    """Connects a device, runs its cycles and, after a failure, disconnects and tries again.

    Parameters
    ----------
    device
        The device; its configuration has `port`, `baud_rate` and `reconnect_delay`.
    log_info, log_error
        Log a line.

    Attributes
    ----------
    connection
        State of the connection, for any thread: replaced as a whole.
    """

    def __init__(
        self, device: Device, log_info: Callable[[str], Any], log_error: Callable[[str], Any]
    ) -> None:
        self.connection = Connection()
        self._device = device
        self._log_info, self._log_error = log_info, log_error
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._port: OpenPort | None = None
        self._guard: Guard | None = None
        self._unsafe = ''
        self._stop_request: StopRequest | None = None
        self._is_connected = self._may_be_on = False

    def start(self) -> None:
        """Start the thread."""
        self._stop.clear()
        self._show('connecting')
        self._thread = threading.Thread(target=self._work, name='device', daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop the thread, if it runs, and wait for it; the device is switched off then."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def keep_going(self) -> bool:
        """Return whether the thread continues; checked once a second at least, which it shows."""
        if self._guard is not None:
            self._guard.beat()
        return not self._stop.is_set()

    def open_port(self, timeout: float, stop: StopRequest | None = None) -> OpenPort:
        """Open the device's port and start its guard, both until the device is disconnected.

        A device that cannot be switched off needs no guard.

        Parameters
        ----------
        timeout
            Longest time that one read blocks [s].
        stop
            Switches the device off, should this process be killed; None if nothing does.

        Raises
        ------
        PortError
            If the port cannot be opened.
        OSError
            If the guard cannot be started.
        """
        config = self._device.config
        self._port = open_port(config.port, config.baud_rate, timeout)
        self._guard = Guard(self._port.fileno(), stop) if stop else None
        self._stop_request = stop
        return self._port

    def _work(self) -> None:
        while self.keep_going():
            try:
                self._stay_connected()
            except (DeviceError, OSError, termios.error) as error:
                if self.keep_going():
                    self._fail(str(error))
            except Exception as error:
                self._fail(f'internal error: {error!r}', traceback.format_exc())
            finally:
                self._make_safe()
            self._stop.wait(self._device.config.reconnect_delay)
        if self._may_be_on and self._stop_request is not None:
            self._leave_to_guard(self._stop_request)
        self._show(Connection().message)

    def _stay_connected(self) -> None:
        self._device.connect()
        self._unsafe, self._is_connected, self._may_be_on = '', True, True
        self.connection = Connection('connected', count=self.connection.count + 1)
        self._log_info(f"connected to '{self._device.config.port}'")
        while self.keep_going():
            self._device.cycle()
            self._keep_guarded()

    def _keep_guarded(self) -> None:
        """Start another guard if the one of the port has ended."""
        guard, port, stop = self._guard, self._port, self._stop_request
        if guard is not None and port is not None and stop is not None and guard.has_ended:
            self._log_error('the guard of the port was killed: starting another one')
            self._guard = Guard(port.fileno(), stop)

    def _make_safe(self) -> None:
        port, self._port = self._port, None
        guard, self._guard = self._guard, None
        was_handled = self._switch_off()
        self._is_connected = False
        if port is not None:
            close_port(port)
        if guard is not None and was_handled:
            guard.dismiss()
        elif guard is not None:
            guard.trigger()

    def _switch_off(self) -> bool:
        """Switch the device off; return False after an error of the program."""
        try:
            self._device.disconnect()
        except DeviceError as error:
            self._log_unsafe(str(error))
            return True
        except Exception:
            self._log_error('internal error in disconnecting:\n' + traceback.format_exc())
            return False
        # A connection that failed before the device was known has switched nothing off.
        if self._is_connected:
            self._may_be_on = False
        return True

    def _leave_to_guard(self, stop: StopRequest) -> None:
        """Let a guard go on switching off a device that was on and has not confirmed it."""
        self._may_be_on = False
        with suppress(DeviceError, OSError, termios.error):  # unplugged
            config = self._device.config
            port = open_port(config.port, config.baud_rate, 0.0)
            Guard(port.fileno(), stop).trigger()
            close_port(port)

    def _log_unsafe(self, trouble: str) -> None:
        """Log once in each series of failures that the device may still be on."""
        if trouble != self._unsafe:
            self._log_error(f'switching off failed: {trouble}')
        self._unsafe = trouble

    def _fail(self, trouble: str, details: str = '') -> None:
        """Diagnose a failure, and log it once for as long as it lasts."""
        if trouble != self.connection.message:
            again = f'trying again every {self._device.config.reconnect_delay} s'
            self._log_error(f'{trouble}; {again}\n{details}'.rstrip())
        self._show(trouble, is_failed=True)

    def _show(self, message: str, is_failed: bool = False) -> None:
        self.connection = replace(self.connection, message=message, is_failed=is_failed)

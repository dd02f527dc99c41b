"""The shells of the nodes: how one runs and ends, and how one keeps a serial device connected."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import signal
import sys
import termios
import threading
import traceback
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper, Updater
from lifecycle_msgs.srv import ChangeState
from nodlidar_common.errors import DeviceError, NodlidarError
from nodlidar_common.node_parameters import declare
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

LOOK_PERIOD = 0.2  # s, between two looks whether to end
_INACTIVE = (DiagnosticStatus.OK, 'not connected: the node is not active')
_CONNECTING = (DiagnosticStatus.OK, 'connecting')
_CONNECTED = (DiagnosticStatus.OK, 'connected')


def run(make_node: Callable[[], Node], args: list[str] | None = None) -> int:
    """Run a node until a signal ends it or it failed; return the exit status."""
    with _ending_signals() as received:
        try:
            _init(args)
            node = make_node()
        except NodlidarError as error:
            print(f'{sys.argv[0]}: {error}', file=sys.stderr)
            rclpy.try_shutdown()
            return 2
        try:
            if isinstance(node, DeviceNode):
                node.start_if_told()
            _spin_until(lambda: bool(received) or getattr(node, 'failed', False), node)
        finally:
            node.destroy_node()
            rclpy.shutdown()
    return 1 if getattr(node, 'failed', False) else 0


def _init(args: list[str] | None) -> None:
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # rcl's: arguments or a file of parameters that it cannot read
        raise NodlidarError(str(error)) from error


@contextmanager
def _ending_signals() -> Iterator[list[int]]:
    """Collect the signals that are to end the program.

    rclpy's own handlers invalidate its context at once: whatever is just being published fails,
    and an executor about to wait raises an error or misses the signal and waits on.
    """
    received: list[int] = []
    ending = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # as nohup has it
        ending.append(signal.SIGHUP)  # the terminal was closed
    before = {
        number: signal.signal(number, lambda got, _: received.append(got)) for number in ending
    }
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _spin_until(is_over: Callable[[], bool], node: Node) -> None:
    # rclpy's spin_until_future_complete keeps some memory for every callback that it runs.
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not is_over():
            executor.spin_once(timeout_sec=LOOK_PERIOD)
    finally:
        executor.shutdown()


class DeviceNode(LifecycleNode):
    """A lifecycle node that keeps one serial device connected while it is active.

    A thread connects, runs cycles and, when the device fails or goes away, disconnects and tries
    again after `reconnect_delay` seconds, for as long as the node is active: a port that is not
    there yet is a diagnosed state, not a failed start. Subclasses give the four steps below; their
    configuration has the fields `port`, `reconnect_delay` and `autostart`.
    """

    def __init__(self, name: str, config_class: type[Any]) -> None:
        super().__init__(name)
        self._survive_impossible_transitions()
        self.config = declare(self, config_class, self._configuration_changed)
        self.failed = False
        self.connections = 0
        self._state = _INACTIVE
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._updater: Updater | None = None

    # What a subclass provides.

    def connect(self) -> None:
        """Open the device and make it ready; raises DeviceError.

        What may take longer than a second asks :meth:`keep_going` and raises StoppedError.
        """
        raise NotImplementedError

    def cycle(self) -> None:
        """Do one round of work, blocking at most about a second; raises DeviceError."""
        raise NotImplementedError

    def disconnect(self) -> None:
        """Leave the device safe and close it; called after any failure, never raises."""
        raise NotImplementedError

    def diagnose(self, status: DiagnosticStatusWrapper) -> None:
        """Add the device's own figures to its diagnostic status, which is OK so far."""

    def _configuration_changed(self, config: Any) -> None:
        self.config = config

    # The life cycle.

    def _survive_impossible_transitions(self) -> None:
        """Refuse a request for a transition that the present state does not have.

        rclpy of Jazzy raises an error out of the service instead, which ends the node
        (ros2/rclpy#1209).
        """
        service = next(s for s in self.services if s.srv_type is ChangeState)
        change_state = service.callback

        def change_or_refuse(
            request: ChangeState.Request, response: ChangeState.Response
        ) -> ChangeState.Response:
            try:
                return change_state(request, response)
            except RuntimeError as error:
                self.get_logger().error(f'transition refused: {error}')
                response.success = False
                return response

        service.callback = change_or_refuse

    def start_if_told(self) -> None:
        """Configure and activate the node if its parameter `autostart` says so.

        A launch file that does the same by requests and events needs them to arrive, which ROS
        does not promise while the nodes are still finding each other.
        """
        if self.config.autostart:
            self.trigger_configure()
            self.trigger_activate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the diagnostics."""
        if self._updater is None:
            self._updater = Updater(self)
            self._updater.setHardwareID(self.config.port)
            self._updater.add('device', self._diagnose)
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the thread that keeps the device connected."""
        result = super().on_activate(state)
        self._stop.clear()
        self._state = _CONNECTING
        self._thread = threading.Thread(target=self._work, name='device', daemon=True)
        self._thread.start()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the thread, which leaves the device safe."""
        self.stop()
        return super().on_deactivate(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the thread, whatever state the node is in."""
        self.stop()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the thread and go back to unconfigured."""
        self.stop()
        return super().on_error(state)

    def destroy_node(self) -> None:
        """Stop the thread before anything that it uses goes away."""
        self.stop()
        super().destroy_node()

    def stop(self) -> None:
        """Stop the device's thread and wait for it; does nothing when there is none."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def keep_going(self) -> bool:
        """Tell whether the device's thread is to go on; what waits for long asks now and then."""
        return not self._stop.is_set()

    # The device's thread.

    def _work(self) -> None:
        try:
            while self.keep_going():
                try:
                    self._stay_connected()
                except (DeviceError, OSError, termios.error) as error:
                    if self.keep_going():
                        self._report(str(error))
                finally:
                    self.disconnect()
                self._stop.wait(self.config.reconnect_delay)
            self._state = _INACTIVE
        except Exception:
            self.get_logger().fatal('internal error, shutting down:\n' + traceback.format_exc())
            self.failed = True

    def _stay_connected(self) -> None:
        self.connect()
        self.connections += 1
        self._state = _CONNECTED
        self.get_logger().info(f"connected to '{self.config.port}'")
        while self.keep_going():
            self.cycle()

    def _report(self, trouble: str) -> None:
        """Log a trouble once for as long as it lasts."""
        if trouble != self._state[1]:
            self.get_logger().error(
                f'{trouble}; trying again every {self.config.reconnect_delay} s'
            )
        self._state = (DiagnosticStatus.ERROR, trouble)

    def _diagnose(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        status.summary(*self._state)
        status.add('port', self.config.port)
        status.add('connections', str(self.connections))
        self.diagnose(status)
        return status

"""The shells of the nodes: how one runs and ends, and how one keeps a serial device connected."""

from collections.abc import Callable
import signal
import sys
import threading
import traceback
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper, Updater
from nodlidar_common.errors import DeviceError, NodlidarError
from nodlidar_common.node_parameters import declare
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node


def run(make_node: Callable[[], Node], args: list[str] | None = None) -> int:
    """Run a node until it is told to end (SIGINT, SIGTERM); return the exit status."""
    # rclpy ends the spinning on its own; a KeyboardInterrupt on top of that could come anywhere,
    # in the middle of a message's conversion too.
    signal.signal(signal.SIGINT, lambda *_: None)
    rclpy.init(args=args)
    try:
        node = make_node()
    except NodlidarError as error:
        print(f'{sys.argv[0]}: {error}', file=sys.stderr)
        rclpy.try_shutdown()
        return 2
    try:
        rclpy.spin(node)
    except ExternalShutdownException:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 1 if getattr(node, 'failed', False) else 0


class DeviceNode(LifecycleNode):
    """A lifecycle node that keeps one serial device connected while it is active.

    A thread connects, runs cycles and, when the device fails or goes away, disconnects and tries
    again after `reconnect_delay` seconds, for as long as the node is active: a port that is not
    there yet is a diagnosed state, not a failed start. Subclasses give the four steps below; their
    configuration has the fields `port` and `reconnect_delay`.
    """

    def __init__(self, name: str, config_class: type[Any]) -> None:
        super().__init__(name)
        self.config = declare(self, config_class, self._configuration_changed)
        self.failed = False
        self.connections = 0
        self._trouble = 'not connected yet'
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._updater: Updater | None = None

    # What a subclass provides.

    def connect(self) -> None:
        """Open the device and make it ready; raises DeviceError."""
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

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the diagnostics."""
        if self._updater is None:
            self._updater = Updater(self)
            self._updater.setHardwareID(self.config.port)
            self._updater.add('device', self._diagnose)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the thread that keeps the device connected."""
        result = super().on_activate(state)
        self._stop.clear()
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
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the thread and go back to unconfigured."""
        self.stop()
        return TransitionCallbackReturn.SUCCESS

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

    # The device's thread.

    def _work(self) -> None:
        try:
            while not self._stop.is_set():
                try:
                    self._stay_connected()
                except DeviceError as error:
                    self._report(str(error))
                finally:
                    self.disconnect()
                self._stop.wait(self.config.reconnect_delay)
            self._trouble = 'not connected: the node is not active'
        except Exception:
            if self.context.ok():  # else a signal came while the thread was publishing
                self._fail(traceback.format_exc())

    def _fail(self, trace: str) -> None:
        self.failed = True
        self.get_logger().fatal('internal error, shutting down:\n' + trace)
        self.context.try_shutdown()

    def _stay_connected(self) -> None:
        self.connect()
        self.connections += 1
        self._trouble = ''
        self.get_logger().info(f"connected to '{self.config.port}'")
        while not self._stop.is_set():
            self.cycle()

    def _report(self, trouble: str) -> None:
        """Log a trouble once for as long as it lasts."""
        if trouble != self._trouble:
            self.get_logger().error(
                f'{trouble}; trying again every {self.config.reconnect_delay} s'
            )
        self._trouble = trouble

    def _diagnose(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        if self._trouble:
            status.summary(DiagnosticStatus.ERROR, self._trouble)
        else:
            status.summary(DiagnosticStatus.OK, 'connected')
        status.add('port', self.config.port)
        status.add('connections', str(self.connections))
        self.diagnose(status)
        return status

"""The shell of a node that keeps a serial device connected."""

import termios
import threading
import traceback
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper
from lifecycle_msgs.srv import ChangeState
from nodlidar_common.errors import DeviceError
from nodlidar_common.guard import Guard, StopRequest
from nodlidar_common.ros.diagnostics import SteadyUpdater
from nodlidar_common.ros.node_parameters import declare
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

_INACTIVE = (DiagnosticStatus.OK, 'not connected: the node is not active')
_CONNECTING = (DiagnosticStatus.OK, 'connecting')
_CONNECTED = (DiagnosticStatus.OK, 'connected')


class DeviceNode(LifecycleNode):
    """A lifecycle node that keeps one serial device connected while it is active.

    A thread connects, runs cycles and, when the device fails or goes away, disconnects and tries
    again after `reconnect_delay` seconds, for as long as the node is active: a port that is not
    there yet is a diagnosed state, not a failed start. Subclasses give the steps below; their
    configuration has the fields `port`, `reconnect_delay` and `autostart`. Parameters that are not
    live can be set until the node is configured.
    """

    def __init__(self, name: str, config_class: type[Any]) -> None:
        super().__init__(name)
        self._survive_impossible_transitions()
        self._is_configured = False
        self.config = declare(
            self,
            config_class,
            self._configuration_changed,
            is_configured=lambda: self._is_configured,
        )
        self.connections = 0
        self._state = _INACTIVE
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._guard: Guard | None = None
        self._updater: SteadyUpdater | None = None

    # What a subclass provides.

    def configure(self) -> None:
        """Take over the parameters: called by each transition to configured."""

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

    def urgent(self) -> object:
        """Return what the diagnostics tell at once when it is another, besides the connection."""
        return None

    def _configuration_changed(self, config: Any) -> None:
        self.config = config

    def guard(self, port: int, stop: StopRequest) -> None:
        """Have the device made safe, should this process be killed, until it is disconnected.

        Parameters
        ----------
        port
            File descriptor of the open port.
        stop
            What makes the device safe.
        """
        self._guard = Guard(port, stop)

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
        """Take over the parameters and start the diagnostics."""
        self.configure()
        if self._updater is None:
            self._updater = SteadyUpdater(
                self, self.config.port, lambda: (self._state, self.urgent())
            )
            self._updater.add('device', self._diagnose)
        self._updater.setHardwareID(self.config.port)
        self._is_configured = True
        return super().on_configure(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the parameters be set again."""
        self._is_configured = False
        return super().on_cleanup(state)

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
        self._is_configured = False
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
        while self.keep_going():
            try:
                self._stay_connected()
            except (DeviceError, OSError, termios.error) as error:
                if self.keep_going():
                    self._report(str(error))
            except Exception as error:
                self._report(f'internal error: {error!r}', traceback.format_exc())
            finally:
                self._make_safe()
            self._stop.wait(self.config.reconnect_delay)
        self._state = _INACTIVE

    def _make_safe(self) -> None:
        try:
            self.disconnect()
        except Exception:
            self.get_logger().error('internal error in disconnecting:\n' + traceback.format_exc())
            return  # the guard goes on: it acts when this process ends
        if self._guard is not None:
            self._guard.dismiss()
            self._guard = None

    def _stay_connected(self) -> None:
        self.connect()
        self.connections += 1
        self._state = _CONNECTED
        self.get_logger().info(f"connected to '{self.config.port}'")
        while self.keep_going():
            self.cycle()

    def _report(self, trouble: str, details: str = '') -> None:
        """Log a trouble once for as long as it lasts."""
        if trouble != self._state[1]:
            again = f'trying again every {self.config.reconnect_delay} s'
            self.get_logger().error(f'{trouble}; {again}\n{details}'.rstrip())
        self._state = (DiagnosticStatus.ERROR, trouble)

    def _diagnose(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        status.summary(*self._state)
        status.add('port', self.config.port)
        status.add('connections', str(self.connections))
        self.diagnose(status)
        return status

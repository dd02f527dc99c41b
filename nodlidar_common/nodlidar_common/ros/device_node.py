"""Base class of a node that keeps a device connected."""

import traceback
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper
from lifecycle_msgs.srv import ChangeState
from nodlidar_common.device_thread import DeviceThread
from nodlidar_common.report import Reporter
from nodlidar_common.ros.diagnostics import SteadyUpdater
from nodlidar_common.ros.node_parameters import declare
from nodlidar_common.ros.steady import steady_ns
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn


class DeviceNode(LifecycleNode):
    """A lifecycle node that keeps one device connected while it is active.

    A missing device is diagnosed and tried again; it does not end the node. Subclasses implement
    the steps below; their configuration has `port`, which names the device, `reconnect_delay` and
    `autostart`, and `baud_rate` if it is on a serial port. Parameters that are not live can be set
    until the node is configured.

    The device's thread runs `connect`, `cycle` and `disconnect`, the executor's thread everything
    else. What one passes to the other is an immutable value, replaced as a whole.

    Attributes
    ----------
    thread
        The device's thread, which opens the port for `connect`.
    diagnosis
        Reports about the device; set by `configure`.
    sole_topic
        A topic on which a second publisher is a warning; empty if there is none.
    """

    diagnosis: Reporter

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
        self.sole_topic = ''
        log = self.get_logger()
        self.thread = DeviceThread(self, log.info, log.error)
        self._updater: SteadyUpdater | None = None

    # What a subclass provides.

    def configure(self) -> None:
        """Apply the parameters and set `diagnosis`: called by each transition to configured."""
        raise NotImplementedError

    def connect(self) -> None:
        """Make the device ready; a port is opened with :meth:`.DeviceThread.open_port`.

        A step that may take longer than a second checks :meth:`.DeviceThread.keep_going`.

        Raises
        ------
        DeviceError
            If the device cannot be used; StoppedError if the thread is stopped meanwhile.
        """
        raise NotImplementedError

    def cycle(self) -> None:
        """Do one round of work, blocking at most about a second; raises DeviceError."""
        raise NotImplementedError

    def disconnect(self) -> None:
        """Switch the device off; called after any failure.

        Raises
        ------
        DeviceError
            If the device does not confirm it.
        """
        raise NotImplementedError

    # The life cycle.

    def autostart(self) -> None:
        """Configure and activate the node if its parameter `autostart` is set.

        A launch file could do the same by requests and events, but ROS does not guarantee that
        these arrive while the nodes are still discovering each other.
        """
        if self.config.autostart:
            if self.trigger_configure() == TransitionCallbackReturn.SUCCESS:
                self.trigger_activate()
            else:
                self.failed = True

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Apply the parameters and start the diagnostics."""
        try:
            self.configure()
            if self._updater is None:
                self._updater = SteadyUpdater(self, self.config.port, self._urgent)
                self._updater.add('device', self._diagnose)
            self._updater.setHardwareID(self.config.port)
        except Exception:  # rclpy would pass over it without a word
            self.get_logger().error(f'cannot be configured:\n{traceback.format_exc()}')
            return TransitionCallbackReturn.FAILURE
        self._is_configured = True
        return super().on_configure(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Allow the parameters to be set again."""
        self._is_configured = False
        return super().on_cleanup(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the thread that keeps the device connected."""
        result = super().on_activate(state)
        self.thread.start()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the thread, which switches the device off."""
        self.thread.stop()
        return super().on_deactivate(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the thread, in any state of the node."""
        self.thread.stop()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the thread; the node is unconfigured again."""
        self.thread.stop()
        self._is_configured = False
        return super().on_error(state)

    def destroy_node(self) -> None:
        """Stop the thread before what it uses is destroyed."""
        self.thread.stop()
        super().destroy_node()

    def _configuration_changed(self, config: Any) -> None:
        self.config = config

    def _survive_impossible_transitions(self) -> None:
        """Refuse a requested transition that the present state does not have.

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
                wanted = request.transition.label or request.transition.id
                self.get_logger().error(f"transition '{wanted}' refused, in this state: {error}")
                response.success = False
                return response

        service.callback = change_or_refuse

    # The diagnostics.

    def _urgent(self) -> object:
        return self.thread.connection, self.diagnosis.urgent(steady_ns())

    def _diagnose(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        connection, report = self.thread.connection, self.diagnosis.next_report(steady_ns())
        level = DiagnosticStatus.ERROR if connection.is_failed else DiagnosticStatus.OK
        status.summary(level, connection.message)
        for warning in (*report.warnings, *self._publisher_warning()):
            status.mergeSummary(DiagnosticStatus.WARN, warning)
        for error in report.errors:
            status.mergeSummary(DiagnosticStatus.ERROR, error)
        status.add('port', self.config.port)
        status.add('connections', str(connection.count))
        for name, value in report.figures.items():
            status.add(name, value)
        return status

    def _publisher_warning(self) -> list[str]:
        count = self.count_publishers(self.sole_topic) if self.sole_topic else 0
        return [f'{count} publishers on {self.sole_topic}: stop all but one'] * (count > 1)

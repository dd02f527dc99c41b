"""Runs a node's diagnostic tasks periodically and publishes their statuses."""

import threading

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_updater._status import DiagnosticStatusWrapper
from underlay_refusal import Partial, refuse_arguments


class Updater(Partial):
    """Publishes the statuses of its tasks on /diagnostics; at most one for each node.

    Declares the parameter ``diagnostic_updater.period`` [s], 1.0 by default.
    """

    def __init__(self, node, **uncovered):
        refuse_arguments('Updater', uncovered)
        self.node = node
        self.node_name = node.get_name()
        self.tasks = []
        self.lock = threading.Lock()
        self.hwid = ''
        self.publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 1)
        self._period = node.declare_parameter('diagnostic_updater.period', 1.0).value
        self.timer = node.create_timer(self._period, self.update)

    @property
    def period(self):
        """Time between two updates [s]."""
        return self._period

    def setHardwareID(self, hwid):  # noqa: N802
        """Set the hardware ID of all later statuses."""
        self.hwid = hwid

    def add(self, name, fn):
        """Add a function that fills in and returns a status; publish that it is starting up."""
        with self.lock:
            self.tasks.append((name, fn))
            self._publish([_status(name, DiagnosticStatus.OK, 'Node starting up')])

    def update(self):
        """Run every task and publish the statuses."""
        with self.lock:
            self._publish([self._run(name, fn) for name, fn in self.tasks])

    def _run(self, name, fn):
        status = _status(name, DiagnosticStatus.ERROR, 'No message was set')
        status.hardware_id = self.hwid
        return fn(status)

    def _publish(self, statuses):
        message = DiagnosticArray(status=[self._message(status) for status in statuses])
        message.header.stamp = self.node.get_clock().now().to_msg()
        self.publisher.publish(message)

    def _message(self, status):
        """Return a status as the message itself: rclpy publishes no subclass of one."""
        return DiagnosticStatus(
            level=status.level,
            name=f'{self.node_name}: {status.name}',
            message=status.message,
            hardware_id=status.hardware_id,
            values=status.values,
        )


def _status(name, level, message):
    return DiagnosticStatusWrapper(name=name, level=level, message=message)

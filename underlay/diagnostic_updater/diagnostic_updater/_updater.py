"""Runs a node's diagnostic tasks periodically and publishes what they say."""

import threading

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_updater._status import DiagnosticStatusWrapper
from diagnostic_updater._tasks import FunctionDiagnosticTask

_PERIOD = 'diagnostic_updater.period'
_USE_FQN = 'diagnostic_updater.use_fqn'


class Updater:
    """Publishes the statuses of its tasks on /diagnostics; at most one for each node.

    Declares the parameters ``diagnostic_updater.period`` [s], whose default is `period`, and
    ``diagnostic_updater.use_fqn``: name the statuses after the node with its namespace.
    """

    def __init__(self, node, period=1.0):
        self.node = node
        self.tasks = []
        self.lock = threading.Lock()
        self.hwid = ''
        self.verbose = False
        self.warn_nohwid_done = False
        self.publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 1)
        self._period = node.declare_parameter(_PERIOD, period).value
        self.timer = node.create_timer(self._period, self.update)
        if not node.has_parameter(_USE_FQN):
            node.declare_parameter(_USE_FQN, False)
        fully_qualified = node.get_parameter(_USE_FQN).value
        namespace = [node.get_namespace()] if fully_qualified else []
        self.node_name = '/'.join([*namespace, node.get_name()])

    @property
    def period(self):
        """Time between two updates [s]; a new one takes effect at once."""
        return self._period

    @period.setter
    def period(self, period):
        self._period = period
        self.node.destroy_timer(self.timer)
        self.timer = self.node.create_timer(period, self.update)

    def setHardwareID(self, hwid):  # noqa: N802
        """Set the hardware id of every status to come."""
        self.hwid = hwid

    def add(self, *args):
        """Add a task: ``add(task)`` or ``add(name, function)``; says that it is starting up."""
        task = args[0] if len(args) == 1 else FunctionDiagnosticTask(*args)
        with self.lock:
            self.tasks.append(task)
            self.publish(_status(task.getName(), DiagnosticStatus.OK, 'Node starting up'))

    def removeByName(self, name):  # noqa: N802
        """Remove the first task of that name and tell whether there was one."""
        with self.lock:
            task = next((task for task in self.tasks if task.getName() == name), None)
            if task is not None:
                self.tasks.remove(task)
        return task is not None

    def update(self):
        """Run every task and publish the statuses."""
        with self.lock:
            statuses = [self._run(task) for task in self.tasks]
        self._warn_without_hardware_id(statuses)
        self.publish(statuses)

    def force_update(self):
        """Update now, besides the periodic updates."""
        self.update()

    def broadcast(self, lvl, msg):
        """Publish one level and message as the status of every task."""
        self.publish([_status(task.getName(), lvl, msg) for task in self.tasks])

    def publish(self, msg):
        """Publish a status or a list of them, the node's name put before theirs."""
        message = DiagnosticArray()
        message.header.stamp = self.node.get_clock().now().to_msg()
        statuses = msg if isinstance(msg, list) else [msg]
        message.status = [self._message(status) for status in statuses]
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

    def _run(self, task):
        status = _status(task.getName(), DiagnosticStatus.ERROR, 'No message was set')
        status.hardware_id = self.hwid
        status = task.run(status)
        if self.verbose and status.level != DiagnosticStatus.OK:
            self.node.get_logger().warning(
                'Non-zero diagnostic status. '
                f'Name: {status.name}, status {status.level}: {status.message}'
            )
        return status

    def _warn_without_hardware_id(self, statuses):
        """Say once that there is no hardware id, when all is well otherwise."""
        all_ok = all(status.level == DiagnosticStatus.OK for status in statuses)
        if all_ok and not self.hwid and not self.warn_nohwid_done:
            self.node.get_logger().warning(
                "diagnostic_updater: no hardware id was set; set it to 'none' if there is none"
            )
            self.warn_nohwid_done = True


def _status(name, level, message):
    status = DiagnosticStatusWrapper(name=name)
    status.summary(level, message)
    return status

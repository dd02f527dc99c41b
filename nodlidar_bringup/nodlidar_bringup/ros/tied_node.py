"""Nodes that end with their launch process."""

from contextlib import suppress
import os
import shutil
import signal
from types import FrameType
from typing import Any

from ament_index_python.packages import PackageNotFoundError
from launch import LaunchContext
from launch.event_handlers import OnProcessStart, OnShutdown
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage
from nodlidar_common.errors import NodlidarError
from nodlidar_common.guard_process import LAUNCH

# Asks the kernel to send SIGTERM when the parent ends, then starts the node, unless the launch has
# already ended and the parent is another process. SIGINT is ignored until the node handles it: a
# node that is interrupted earlier would print a traceback. The guard of its device kills a node
# that does not react (nodlidar_common.guard).
_PREFIX = (
    'setpriv --pdeathsig TERM sh -c '
    f'\'trap "" INT; export {LAUNCH}=$PPID; test $PPID -eq {{}} && exec "$0" "$@"\''
)


def tied_node(context: LaunchContext, package: str, executable: str, **options: Any) -> Node:
    """Return a node that the kernel ends when the launch process ends, even by SIGKILL.

    Without setpriv (util-linux), or if the user sets launch-prefix, the node is an ordinary one.
    A Ctrl-C ends the launch in order from now on, even while it is starting a process. It ends the
    node at once, even while that is starting.

    Parameters
    ----------
    context
        Launch context.
    package, executable, options
        Arguments of Node.

    Raises
    ------
    NodlidarError
        If the executable does not exist. Node itself would fail after other nodes have started.
    """
    try:
        ExecutableInPackage(package=package, executable=executable).perform(context)
    except (PackageNotFoundError, RuntimeError) as error:
        raise NodlidarError(f"package '{package}' is not installed as needed: {error}") from error
    _leave_sigint_to(context)
    if 'launch-prefix' not in context.launch_configurations and shutil.which('setpriv'):
        options |= {'prefix': _PREFIX.format(os.getpid()), 'exec_name': executable}
    node = Node(package=package, executable=executable, output='screen', **options)
    context.register_event_handler(OnProcessStart(target_action=node, on_start=_end_at_shutdown))
    return node


def _end_at_shutdown(started: Any, context: LaunchContext) -> None:
    """Send a process SIGTERM when the launch shuts down, or now if it does already.

    launch itself sends it 5 s later, or 3 s to a device's node, and SIGINT at once. But a node
    that is starting ignores that, and launch in a terminal leaves it to the terminal's Ctrl-C,
    which a process that starts just after it has not heard. Such a node would start its device,
    and run until then.
    """
    with suppress(OSError):  # the process has ended, or the kernel is older than 5.3
        process = os.pidfd_open(started.pid)  # its number may later be another process's

        def end(*_: Any) -> None:
            with suppress(OSError):
                signal.pidfd_send_signal(process, signal.SIGTERM)

        if context.is_shutdown:
            end()
        else:
            context.register_event_handler(OnShutdown(on_shutdown=end))


class _LeftToLaunch:
    """A handler of SIGINT that does nothing while a launch runs; otherwise it is Python's.

    A launch hears of a SIGINT by its wakeup file descriptor, and shuts down. Python's handler
    would also raise KeyboardInterrupt, wherever the launch is (launch 3.4). If that is where it
    starts a process, it loses the process, which then runs on, and waits for it for ever.
    """

    def __init__(self, context: LaunchContext) -> None:
        self._context = context

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if self._context.asyncio_loop is None:
            signal.default_int_handler(number, frame)


def _leave_sigint_to(context: LaunchContext) -> None:
    """Replace Python's handler of SIGINT, but none that a program has set."""
    handler = signal.getsignal(signal.SIGINT)
    if handler is signal.default_int_handler or isinstance(handler, _LeftToLaunch):
        signal.signal(signal.SIGINT, _LeftToLaunch(context))

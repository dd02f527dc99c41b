"""Nodes that end with their launch process."""

import os
import shutil
import signal
from types import FrameType
from typing import Any

from ament_index_python.packages import PackageNotFoundError
from launch import LaunchContext
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage
from nodlidar_common.errors import NodlidarError
from nodlidar_common.guard_process import LAUNCH

# Asks the kernel to send SIGTERM when the parent ends, then starts the node, unless the launch has
# already ended and the parent is another process. SIGINT is ignored until the node handles it: a
# node that is interrupted earlier would print a traceback. launch sends SIGTERM after 5 s. The
# guard of its device kills a node that does not react (nodlidar_common.guard).
_PREFIX = (
    'setpriv --pdeathsig TERM sh -c '
    f'\'trap "" INT; export {LAUNCH}=$PPID; test $PPID -eq {{}} && exec "$0" "$@"\''
)


def tied_node(context: LaunchContext, package: str, executable: str, **options: Any) -> Node:
    """Return a node that the kernel ends when the launch process ends, even by SIGKILL.

    Without setpriv (util-linux), or if the user sets launch-prefix, the node is an ordinary one.
    A Ctrl-C ends the launch in order from now on, even while it is starting a process.

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
    return Node(package=package, executable=executable, output='screen', **options)


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

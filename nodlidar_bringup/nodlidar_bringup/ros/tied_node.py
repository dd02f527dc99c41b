"""Nodes that end with their launch process."""

import os
import shutil
from typing import Any

from ament_index_python.packages import PackageNotFoundError
from launch import LaunchContext
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage
from nodlidar_common.errors import NodlidarError

# Asks the kernel to send SIGTERM when the parent ends, then starts the node, unless the launch has
# already ended and the parent is another process. SIGINT is ignored until the node handles it: a
# node that ends at once would print a traceback, and launch may wait forever for it (osrf_pycommon
# 2.1 misses the end of a process before its pipes are connected). launch sends SIGTERM after 5 s.
_PREFIX = 'setpriv --pdeathsig TERM sh -c \'trap "" INT; test $PPID -eq {} && exec "$0" "$@"\''


def tied_node(context: LaunchContext, package: str, executable: str, **options: Any) -> Node:
    """Return a node that the kernel ends when the launch process ends, even by SIGKILL.

    Without setpriv (util-linux), or if the user sets launch-prefix, the node is an ordinary one.

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
    if 'launch-prefix' not in context.launch_configurations and shutil.which('setpriv'):
        options |= {'prefix': _PREFIX.format(os.getpid()), 'exec_name': executable}
    return Node(package=package, executable=executable, output='screen', **options)

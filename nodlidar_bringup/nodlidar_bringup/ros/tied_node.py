"""Nodes that do not outlive their launch."""

import os
import shutil
from typing import Any

from ament_index_python.packages import PackageNotFoundError
from launch import LaunchContext
from launch_ros.actions import Node
from launch_ros.substitutions import ExecutableInPackage
from nodlidar_common.errors import NodlidarError

# Asks the kernel for SIGTERM at the end of the parent, then starts the node if the parent, which
# may have ended before, is still the launch.
_PREFIX = 'setpriv --pdeathsig TERM sh -c \'test $PPID -eq {} && exec "$0" "$@"\''


def tied_node(context: LaunchContext, package: str, executable: str, **options: Any) -> Node:
    """Return a node that the kernel ends when the launch is gone, even killed.

    Where the system has no setpriv (util-linux), or the user gives a launch-prefix of their own,
    the node is an ordinary one.

    Parameters
    ----------
    context
        Of the launch.
    package, executable, options
        As of Node.

    Raises
    ------
    NodlidarError
        If there is no such executable: while the node is made, not when others have started.
    """
    try:
        ExecutableInPackage(package=package, executable=executable).perform(context)
    except (PackageNotFoundError, RuntimeError) as error:
        raise NodlidarError(f"package '{package}' is not installed as needed: {error}") from error
    if 'launch-prefix' not in context.launch_configurations and shutil.which('setpriv'):
        options |= {'prefix': _PREFIX.format(os.getpid()), 'exec_name': executable}
    return Node(package=package, executable=executable, output='screen', **options)

"""ROS nodes as processes."""

from collections.abc import Mapping
from typing import Any

from launch import LaunchContext
from launch.actions import ExecuteProcess

from ..parameter_files import write_parameters
from ..substitutions import ExecutableInPackage


class Node(ExecuteProcess):
    """Run a ROS node.

    Parameters
    ----------
    package, executable
        The package and the executable in it.
    namespace
        Of the node.
    name
        Of the node, by default the one in its code.
    parameters
        Paths of parameter files and dictionaries of parameters; later ones take precedence.
    arguments
        Other arguments, which come first.
    exec_name
        Name of the process, by default that of the executable.
    options
        As of ExecuteProcess: output, prefix, on_exit, sigterm_timeout, sigkill_timeout.

    """

    def __init__(
        self,
        *,
        package: str,
        executable: str,
        namespace: str,
        name: str | None = None,
        parameters: list[str | Mapping[str, Any]] | None = None,
        arguments: list[str] | None = None,
        exec_name: str | None = None,
        **options: Any,
    ) -> None:
        super().__init__(cmd=arguments or [], name=exec_name, **options)
        self._path = ExecutableInPackage(executable, package)
        self._namespace = '/' + namespace.strip('/')
        self._node_name = name
        self._parameters = parameters or []

    def command(self, context: LaunchContext) -> list[str]:
        """Return the command line without the prefix."""
        cmd = [self._path.perform(context), *super().command(context), '--ros-args']
        full_name = '/**'
        if self._node_name is not None:
            cmd += ['-r', f'__node:={self._node_name}']
            full_name = f'{self._namespace.rstrip("/")}/{self._node_name}'
        cmd += ['-r', f'__ns:={self._namespace}']
        for each in self._parameters:
            path = each if isinstance(each, str) else write_parameters(full_name, each)
            cmd += ['--params-file', path]
        return cmd

"""ROS nodes as processes."""

from collections.abc import Iterable, Mapping
import os
from typing import Any

from launch import LaunchContext, SomeSubstitutionsType
from launch.actions import ExecuteProcess
from launch.log import log
from launch.substitution import normalize, perform
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

from ..parameter_files import normalize_parameters, write_parameters
from ..substitutions import ExecutableInPackage

Parameters = Mapping[str, Any] | SomeSubstitutionsType | os.PathLike[str]


class Node(ExecuteProcess):
    """Run a ROS node.

    Parameters
    ----------
    package, executable
        The package and the executable in it.
    name, namespace
        Name and namespace of the node, by default what its code says.
    parameters
        Paths of parameter files and dictionaries of parameters; later ones take precedence.
    arguments
        Other arguments, which come first.
    exec_name
        Name of the process, by default that of the executable.

    """

    def __init__(
        self,
        *,
        executable: SomeSubstitutionsType,
        package: SomeSubstitutionsType | None = None,
        name: SomeSubstitutionsType | None = None,
        namespace: SomeSubstitutionsType | None = None,
        parameters: list[Parameters] | None = None,
        arguments: Iterable[SomeSubstitutionsType] | None = None,
        exec_name: SomeSubstitutionsType | None = None,
        **options: Any,
    ) -> None:
        if not isinstance(parameters, (list, type(None))):
            raise TypeError(f"Node: expected a list of 'parameters', got {parameters!r}")
        if package is None:
            raise NotImplementedError('Node without package is not covered')
        path = ExecutableInPackage(package=package, executable=executable)
        super().__init__(cmd=[path, *(arguments or []), '--ros-args'], name=exec_name, **options)
        self._node_name = None if name is None else normalize(name)
        self._namespace = None if namespace is None else normalize(namespace)
        self._parameters = [_normalize(each) for each in parameters or []]

    def command(self, context: LaunchContext) -> list[str]:
        """Return the whole command line as text."""
        cmd = super().command(context)
        full_name = '/**'
        if self._node_name is not None:
            name = perform(context, self._node_name)
            validate_node_name(name)
            cmd += ['-r', f'__node:={name}']
        if self._namespace is not None:
            namespace = '/' + perform(context, self._namespace).removeprefix('/').rstrip('/')
            validate_namespace(namespace)
            cmd += ['-r', f'__ns:={namespace}']
            if self._node_name is not None:
                full_name = f'{namespace.rstrip("/")}/{name}'
        for parameters in self._parameters:
            cmd += _parameter_arguments(context, parameters, full_name)
        return cmd


def _normalize(parameters: Parameters) -> Any:
    if isinstance(parameters, Mapping):
        return normalize_parameters(parameters)
    path = os.fspath(parameters) if isinstance(parameters, os.PathLike) else parameters
    return normalize(path)


def _parameter_arguments(context: LaunchContext, parameters: Any, node: str) -> list[str]:
    if isinstance(parameters, Mapping):
        return ['--params-file', write_parameters(context, node, parameters)]
    path = perform(context, parameters)
    if os.path.isfile(path):
        return ['--params-file', path]
    log('WARNING', __name__, f'Parameter file path is not a file: {path}')
    return []

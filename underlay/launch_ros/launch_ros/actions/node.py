"""ROS nodes as processes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from launch import LaunchContext, SomeSubstitutionsType
from launch.actions import ExecuteProcess
from launch.logging import get_logger
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name
import yaml

from ..namespaces import make_namespace_absolute, prefix_namespace
from ..parameter_descriptions import ParameterFile
from ..parameters import evaluate_parameters
from ..substitutions import ExecutableInPackage
from ..temporary_file import temporary_file

_UNNAMED = '<node_name_unspecified>'
_NO_NAMESPACE = '<node_namespace_unspecified>'


class Node(ExecuteProcess):
    """Run a ROS node.

    Parameters
    ----------
    executable
        Name of the executable in the package, or without a package its path.
    package
        Package that has the executable.
    name, namespace
        Name and namespace of the node, by default what its code says; a relative namespace is
        one in that of PushROSNamespace.
    exec_name
        Name of the process, by default that of the executable.
    parameters
        Paths of parameter files and dictionaries of parameters; later ones take precedence.
    remappings
        Pairs of names, from and to.
    ros_arguments
        ROS arguments to add.
    arguments
        Other arguments, which come first.

    """

    UNSPECIFIED_NODE_NAME = _UNNAMED
    UNSPECIFIED_NODE_NAMESPACE = _NO_NAMESPACE

    def __init__(
        self,
        *,
        executable: SomeSubstitutionsType,
        package: SomeSubstitutionsType | None = None,
        name: SomeSubstitutionsType | None = None,
        namespace: SomeSubstitutionsType | None = None,
        exec_name: SomeSubstitutionsType | None = None,
        parameters: list[Any] | None = None,
        remappings: Iterable[tuple[SomeSubstitutionsType, SomeSubstitutionsType]] | None = None,
        ros_arguments: Iterable[SomeSubstitutionsType] | None = None,
        arguments: Iterable[SomeSubstitutionsType] | None = None,
        **kwargs: Any,
    ) -> None:
        if package is not None:
            executable = ExecutableInPackage(package=package, executable=executable)
        ros = ['--ros-args', *ros_arguments] if ros_arguments is not None else []
        cmd = [executable, *(arguments or []), *ros, '--ros-args']
        super().__init__(cmd=cmd, name=exec_name, **kwargs)
        self._node_name, self._node_namespace = name, namespace
        self._parameters = _check_parameters(parameters)
        self._remappings = [_check_remapping(rule) for rule in remappings or []]
        self._full_name: str | None = None

    @property
    def node_name(self) -> str:
        """The node's full name, with stand-ins for what only its code knows."""
        if self._full_name is None:
            raise RuntimeError("cannot access 'node_name' before executing action")
        return self._full_name

    def is_node_name_fully_specified(self) -> bool:
        """Tell if the launch description gives both name and namespace."""
        return _UNNAMED not in self.node_name and _NO_NAMESPACE not in self.node_name

    def _command(self, context: LaunchContext) -> list[str]:
        """Return the whole command line as text."""
        name = self._expand_name(context)
        names = [] if self._node_name is None else ['-r', f'__node:={name}']
        return [
            *super()._command(context),
            *names,
            *self._namespace_arguments(context, name),
            *self._parameter_arguments(context),
            *self._remapping_arguments(context),
        ]

    def _expand_name(self, context: LaunchContext) -> str:
        if self._node_name is None:
            return _UNNAMED
        name = _text(context, self._node_name)
        validate_node_name(name)
        return name

    def _namespace_arguments(self, context: LaunchContext, name: str) -> list[str]:
        own = None if self._node_namespace is None else _text(context, self._node_namespace)
        base = context.launch_configurations.get('ros_namespace')
        namespace = make_namespace_absolute(prefix_namespace(base, own))
        self._full_name = prefix_namespace(namespace or _NO_NAMESPACE, name)
        if namespace is None:
            return []
        validate_namespace(namespace)
        return ['-r', f'__ns:={namespace}']

    def _parameter_arguments(self, context: LaunchContext) -> list[str]:
        arguments = []
        for name, value in context.launch_configurations.get('global_params', []):
            arguments += ['-p', f'{name}:={value}']
        for parameters in self._parameters:
            path = self._parameter_path(context, parameters)
            if path.is_file():
                arguments += ['--params-file', str(path)]
            else:
                get_logger(__name__).warning(f'Parameter file path is not a file: {path}')
        return arguments

    def _parameter_path(self, context: LaunchContext, parameters: ParameterFile | Mapping) -> Path:
        if isinstance(parameters, ParameterFile):
            return parameters.evaluate(context)
        node = self.node_name if self.is_node_name_fully_specified() else '/**'
        content = {node: {'ros__parameters': evaluate_parameters(context, parameters)}}
        return temporary_file(self, yaml.safe_dump(content, default_flow_style=False))

    def _remapping_arguments(self, context: LaunchContext) -> list[str]:
        arguments = []
        for source, target in self._remappings:
            arguments += ['-r', f'{_text(context, source)}:={_text(context, target)}']
        return arguments

    def execute(self, context: LaunchContext) -> None:
        """Start the node, and warn if there is one of its name already."""
        super().execute(context)
        if not self.is_node_name_fully_specified():
            return
        counts = context.get_locals_as_dict().get('unique_ros_node_names', Counter())
        counts[self.node_name] += 1
        context.extend_globals({'unique_ros_node_names': counts})
        if counts[self.node_name] > 1:
            get_logger(self.name).warning(
                f'there are now at least {counts[self.node_name]} nodes with the name '
                f'{self.node_name} created within this launch context'
            )


def _text(context: LaunchContext, value: SomeSubstitutionsType) -> str:
    return perform_substitutions(context, normalize_to_list_of_substitutions(value))


def _check_parameters(parameters: list[Any] | None) -> list[ParameterFile | Mapping]:
    if not isinstance(parameters, (list, type(None))):
        raise TypeError(f"Node: expected a list of 'parameters', got {parameters!r}")
    kept = (ParameterFile, Mapping)
    return [x if isinstance(x, kept) else ParameterFile(x) for x in parameters or []]


def _check_remapping(rule: Any) -> tuple[SomeSubstitutionsType, SomeSubstitutionsType]:
    if not isinstance(rule, tuple) or len(rule) != 2:
        raise TypeError(f'remappings: expected tuples of two names, got {rule!r}')
    return rule

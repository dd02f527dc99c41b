"""Parameters of a node from the YAML file that it is started with, without ROS."""

from collections.abc import Mapping
from dataclasses import Field, fields
from pathlib import Path
from typing import Any

from nodlidar_common.errors import ParameterError
from nodlidar_common.yaml_file import read_yaml, YamlError


def file_values(path: Path, node: str, config_class: type[Any]) -> dict[str, Any]:
    """Return the values that a file gives to the parameters of a node.

    As ROS does, it takes those under ``/**`` and under the node's name, in whatever namespace, the
    latter before the former, and passes over what is no parameter of the node.

    Parameters
    ----------
    path
        Of the file.
    node
        The node's name.
    config_class
        Its configuration (see nodlidar_common.parameters).

    Raises
    ------
    ParameterError
        If the file cannot be read, is no parameter file, or a value is not of its parameter's
        type.
    """
    own = {each.name: each for each in fields(config_class)}
    given: dict[str, Any] = {}
    for parameters in _sections(path, node):
        given |= parameters
    return {key: _typed(own[key], value) for key, value in given.items() if key in own}


def read_parameters(path: Path | str) -> dict[Any, Any]:
    """Return the sections of a parameter file by their names; raises YamlError if it is none."""
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise YamlError(str(path), "is no file of parameters, such as '/**: ...'")
    return content


def _sections(path: Path, node: str) -> list[Mapping[str, Any]]:
    """Return what the sections that are meant for a node hold, those for all nodes first."""
    content = read_parameters(path)
    found: list[Mapping[str, Any]] = []
    for name in ('**', '*', node):
        for key, section in content.items():
            if str(key).rsplit('/', 1)[-1] != name:
                continue
            parameters = section.get('ros__parameters') if isinstance(section, dict) else None
            if not isinstance(parameters, dict):
                problem = f"'{key}' must be a section with 'ros__parameters'"
                raise YamlError(str(path), problem)
            found.append(parameters)
    return found


def _typed(parameter: 'Field[Any]', value: Any) -> Any:
    """Return a value if it is of the type of a parameter; a tuple of a list."""
    default = parameter.default
    if isinstance(default, tuple) and isinstance(value, list):
        kinds = {type(each) for each in default}
        if all(type(each) in kinds for each in value):
            return tuple(value)
    elif type(value) is type(default):
        return value
    wanted = f'of type {type(default).__name__}'
    if isinstance(default, tuple):
        wanted = f'a list of {type(default[0]).__name__}s'
    raise ParameterError(parameter.name, wanted, value)

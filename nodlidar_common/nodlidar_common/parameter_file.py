"""Parameters of a node from its YAML file, without ROS."""

from collections.abc import Iterator, Mapping
from dataclasses import Field, fields
from functools import cache
from pathlib import Path
import sys
from typing import Any

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import misspelt, type_in_words
from nodlidar_common.yaml_file import read_yaml, YamlError


def file_values(path: Path, node: str, config_class: type[Any]) -> dict[str, Any]:
    """Return the values that a file sets for the parameters of a node.

    As in ROS, these are the values under ``/**`` and under the node's name in any namespace, which
    override the former. Unknown parameters are ignored, with a line on stderr for one that is
    almost a known one.

    Parameters
    ----------
    path
        The parameter file.
    node
        The node's name.
    config_class
        Its configuration (see nodlidar_common.parameters).

    Raises
    ------
    ParameterError
        If the file cannot be read or is not a parameter file, or a value does not have the type
        of its parameter.
    """
    own = {each.name: each for each in fields(config_class)}
    values: dict[str, Any] = {}
    for parameters in sections(path, node):
        values |= parameters
    for remark in misspelt([str(key) for key in values], own):
        _say(f"'{path}': {remark}")
    return {key: _typed(own[key], value) for key, value in values.items() if key in own}


@cache
def _say(remark: str) -> None:
    """Print a remark on stderr, once."""
    print(remark, file=sys.stderr)


def read_parameters(path: Path | str) -> dict[Any, Any]:
    """Return the sections of a parameter file by name.

    Raises
    ------
    YamlError
        If it has none, or a value that is in none, which ROS refuses.
    """
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise YamlError(str(path), "is not a parameter file, such as '/**: ...'")
    for key, section in content.items():
        if not isinstance(section, dict):
            problem = f"'{key}' must be in a section such as '/**', under 'ros__parameters'"
            raise YamlError(str(path), problem)
    return content


def sections(path: Path, node: str) -> list[Mapping[str, Any]]:
    """Return the parameters in each section for a node; sections for all nodes come first.

    Raises
    ------
    YamlError
        If the file cannot be read or is not a parameter file.
    """
    content = [*_of_nodes(read_parameters(path))]
    found: list[Mapping[str, Any]] = []
    for name in ('**', '*', node):
        for key, section in content:
            if str(key).rsplit('/', 1)[-1] != name:
                continue
            parameters = section.get('ros__parameters')
            if not isinstance(parameters, dict):
                problem = f"'{key}' must be a section with 'ros__parameters'"
                raise YamlError(str(path), problem)
            found.append(parameters)
    return found


def _of_nodes(content: Mapping[Any, Any]) -> Iterator[tuple[Any, dict[Any, Any]]]:
    """Yield the sections of nodes with their names, also those within namespaces."""
    for key, section in content.items():
        holds_sections = section and all(isinstance(each, dict) for each in section.values())
        if holds_sections and 'ros__parameters' not in section:
            yield from _of_nodes(section)
        else:
            yield key, section


def _typed(parameter: 'Field[Any]', value: Any) -> Any:
    """Return a value that has the type of a parameter, a list as a tuple."""
    default = parameter.default
    if isinstance(default, tuple) and isinstance(value, list):
        kinds = {type(each) for each in default}
        if all(type(each) in kinds for each in value):
            return tuple(value)
    elif type(value) is type(default):
        return value
    is_bare_word = isinstance(default, str) and isinstance(value, bool)  # to YAML, off is false
    quotes = ', in quotes' if is_bare_word else ''
    raise ParameterError(parameter.name, type_in_words(parameter) + quotes, value)

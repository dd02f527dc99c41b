"""Parameters of a node from its YAML file, without ROS."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import Field, fields
from functools import cache
from pathlib import Path
import re
import sys
from typing import Any

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import misspelt, type_in_words
from nodlidar_common.yaml_file import read_yaml, YamlError

_NAME = re.compile(r'(/(\*\*?|[A-Za-z_]\w*))+', re.ASCII)


def file_values(paths: Iterable[Path | str], node: str, config_class: type[Any]) -> dict[str, Any]:
    """Return the values that files set for the parameters of a node.

    Unknown parameters are ignored, with a line on stderr for one that is almost a known one.

    Parameters
    ----------
    paths
        The parameter files, in the order in which the node gets them.
    node
        The node's name, as for :func:`sections`.
    config_class
        Its configuration (see nodlidar_common.parameters).

    Raises
    ------
    ParameterError
        If a file cannot be read or is not a parameter file, or a value does not have the type
        of its parameter.
    """
    own = {each.name: each for each in fields(config_class)}
    files = {path: read_parameters(path) for path in paths}
    for path, file in files.items():
        for remark in misspelt([key for each in sections(node, file) for key in each], own):
            _say(f"'{path}': {remark}")
    values: dict[str, Any] = {}
    for parameters in sections(node, *files.values()):
        values |= parameters
    return {key: _typed(own[key], value) for key, value in values.items() if key in own}


@cache
def _say(remark: str) -> None:
    """Print a remark on stderr, once."""
    print(remark, file=sys.stderr)


def read_parameters(path: Path | str) -> dict[str, dict[str, Any]]:
    """Return the parameters in each section of a file by the section's name, in their order.

    Raises
    ------
    YamlError
        If the file cannot be read or is not a parameter file, which ROS refuses.
    """
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise YamlError(str(path), "is not a parameter file, such as '/**: ...'")
    return _merged(_of_nodes(str(path), content))


def sections(node: str, *files: Mapping[str, Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the parameters in each section for a node; later ones override earlier ones.

    As in rcl and rclpy, ``*`` in the name of a section stands for one name, ``**`` for any number
    of them. A section stands where its name comes first, even in an earlier file.

    Parameters
    ----------
    node
        The node's name with its namespace, such as '/left/servo'; without a slash, it counts in
        any namespace.
    files
        As from :func:`read_parameters`, in the order in which the node gets them.
    """
    merged = _merged(section for file in files for section in file.items())
    return [parameters for name, parameters in merged.items() if _is_for(name, node)]


def _is_for(section: str, node: str) -> bool:
    if not node.startswith('/'):
        section, node = section.rpartition('/')[2], f'/{node}'
    pattern = _absolute(section).replace('/*', r'(/\w+)')  # and so '/**' is '(/\w+)*'
    return re.fullmatch(pattern, node, re.ASCII) is not None


def _absolute(name: str) -> str:
    return '/' + name.removeprefix('/')


def _merged(found: Iterable[tuple[str, Mapping[str, Any]]]) -> dict[str, dict[str, Any]]:
    merged: dict[str, dict[str, Any]] = {}
    for name, parameters in found:
        merged.setdefault(name, {}).update(parameters)
    return merged


def _of_nodes(
    file: str, content: Mapping[str, Any], namespace: str = ''
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the sections of nodes with their names, also those within namespaces."""
    for key, section in content.items():
        name = f'{namespace}{key}'
        if not isinstance(section, dict):
            problem = f"'{key}' must be in a section such as '/**', under 'ros__parameters'"
            raise YamlError(file, problem)
        if 'ros__parameters' not in section:
            yield from _of_nodes(file, section, name.removesuffix('/') + '/')
            continue
        parameters = section['ros__parameters']
        if not isinstance(parameters, dict) or len(section) > 1:
            raise YamlError(file, f"'{name}' must be a section with 'ros__parameters' alone")
        if not _NAME.fullmatch(_absolute(name)):
            raise YamlError(file, f"'{name}' must be a node's name or a pattern such as '/**'")
        yield name, parameters


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

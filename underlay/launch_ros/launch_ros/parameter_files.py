"""Files that pass the parameters of dictionaries on to nodes."""

import atexit
from collections.abc import Iterator, Mapping
from functools import cache
import shutil
from tempfile import mkdtemp, NamedTemporaryFile
from typing import Any

from launch import LaunchContext, Substitution
from launch.substitution import is_substitution
import yaml

from .parameter_descriptions import is_value, ParameterValue


def normalize_parameters(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters by their whole names; TypeError for what no parameter can have."""
    return dict(_normalize(parameters, ''))


def _normalize(parameters: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for name, value in parameters.items():
        if is_substitution(name):
            raise NotImplementedError(f'substitutions in a name, {name!r}, are not covered')
        if not isinstance(name, str):
            raise TypeError(f'a parameter cannot have the name {name!r}')
        if isinstance(value, Mapping):
            yield from _normalize(value, f'{prefix}{name}.')
        else:
            yield prefix + name, _normalize_value(value)


def _normalize_value(value: Any) -> Any:
    if isinstance(value, Substitution):
        return ParameterValue(value)
    if is_substitution(value):
        raise NotImplementedError(f'substitutions in a list, {value!r}, are not covered')
    if isinstance(value, (list, tuple)):
        is_float = {type(item) for item in value} == {int, float}
        value = [float(item) if is_float else item for item in value]
    if not isinstance(value, ParameterValue) and not is_value(value):
        raise TypeError(f'a parameter cannot have the value {value!r}')
    return value


def write_parameters(context: LaunchContext, node: str, parameters: Mapping[str, Any]) -> str:
    """Write a parameter file for a node, which is there until the interpreter ends."""
    values = {name: _evaluate(context, value) for name, value in parameters.items()}
    text = yaml.safe_dump({node: {'ros__parameters': values}}, default_flow_style=False)
    with NamedTemporaryFile('w', dir=_directory(), suffix='.yaml', delete=False) as file:
        file.write(text)
    return file.name


def _evaluate(context: LaunchContext, value: Any) -> Any:
    return value.evaluate(context) if isinstance(value, ParameterValue) else value


@cache
def _directory() -> str:
    path = mkdtemp(prefix='launch_params_')
    atexit.register(shutil.rmtree, path)
    return path

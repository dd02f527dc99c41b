"""Dictionaries of parameters with substitutions in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from launch import LaunchContext, Substitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import is_substitution
import yaml

from .parameter_descriptions import ParameterValue

_SCALARS = (bool, int, float, str, bytes)


def evaluate_parameters(context: LaunchContext, parameters: Mapping) -> dict[str, Any]:
    """Return parameters by their full names; those of nested dictionaries are joined by dots.

    Text that substitutions give is read by the rules of YAML; ParameterValue gives it a type.

    Raises
    ------
    TypeError
        When a value is none that a parameter can have.

    """
    evaluated: dict[str, Any] = {}
    for key, value in parameters.items():
        name = perform_substitutions(context, normalize_to_list_of_substitutions(key))
        if isinstance(value, Mapping):
            inner = evaluate_parameters(context, value)
            evaluated.update({f'{name}.{key}': x for key, x in inner.items()})
        else:
            evaluated[name] = _evaluate(context, name, value)
    return evaluated


def _evaluate(context: LaunchContext, name: str, value: Any) -> Any:
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if isinstance(value, _SCALARS):
        return value
    if is_substitution(value):
        return _read(name, _text(context, value))
    if isinstance(value, Sequence):
        return _evaluate_list(context, name, value)
    raise TypeError(f'Unexpected type for parameter value {value!r} of "{name}"')


def _text(context: LaunchContext, value: Any) -> str:
    return perform_substitutions(context, normalize_to_list_of_substitutions(value))


def _read(name: str, text: str) -> Any:
    """Return what YAML makes of a text."""
    try:
        value = yaml.safe_load(text) if text else ''
    except yaml.YAMLError as error:
        raise TypeError(
            f'Unable to parse the value of parameter {name} as yaml. '
            'If the parameter is meant to be a string, try wrapping it in '
            'launch_ros.parameter_descriptions.ParameterValue(value, value_type=str)'
        ) from error
    if isinstance(value, list):
        return _uniform(name, value)
    if not isinstance(value, _SCALARS):
        raise TypeError(
            'Allowed value types are bytes, bool, int, float, str, Sequence[bool], Sequence[int]'
            f', Sequence[float], Sequence[str]. Got {type(value)} for "{name}". '
            'If the parameter is meant to be a string, try wrapping it in '
            'launch_ros.parameter_descriptions.ParameterValue(value, value_type=str)'
        )
    return value


def _evaluate_list(context: LaunchContext, name: str, values: Sequence) -> list:
    if {type(x) for x in values} == {int, float}:
        return [float(x) for x in values]
    return _uniform(name, [_item(context, x) for x in values])


def _item(context: LaunchContext, value: Any) -> Any:
    if isinstance(value, (Substitution, list, tuple)):
        return yaml.safe_load(_text(context, value))
    return value


def _uniform(name: str, values: list) -> list:
    types = {type(x) for x in values}
    if len(types) != 1 or not types <= {bool, int, float, str}:
        raise TypeError(
            'Expected a non-empty sequence, with items of uniform type. '
            'Allowed sequence item types are bool, int, float, str. '
            f'Got inconsistent input for "{name}"'
        )
    return values

"""Values that are given as such or as substitutions whose text is read as YAML."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, get_args, get_origin, TYPE_CHECKING

from underlay_refusal import refuse
import yaml

from ..substitution import Substitution
from . import normalize_to_list_of_substitutions, perform_substitutions

if TYPE_CHECKING:
    from ..launch_context import LaunchContext

__all__ = [
    'coerce_to_type',
    'is_substitution',
    'normalize_typed_substitution',
    'perform_typed_substitution',
]
__getattr__ = refuse(__name__, __all__)

SCALARS = (bool, int, float, str)


def is_substitution(x: Any) -> bool:
    """Tell if x is a substitution, or several texts with at least one substitution."""
    if isinstance(x, Substitution):
        return True
    if isinstance(x, str) or not isinstance(x, Iterable):
        return False
    items = list(x)
    return all(isinstance(item, (str, Substitution)) for item in items) and any(
        isinstance(item, Substitution) for item in items
    )


def _item_type(data_type: Any) -> tuple[Any, bool]:
    """Split List[x] into x and whether it is a list."""
    is_list = get_origin(data_type) is list
    item = get_args(data_type)[0] if is_list else data_type
    if item not in SCALARS:
        raise ValueError(f'Unrecognized data type: {data_type}')
    return item, is_list


def _is_valid(value: Any, data_type: Any) -> bool:
    """Tell if value is of the type, or with None a scalar or a list of scalars of one type."""
    if data_type is not None:
        item, is_list = _item_type(data_type)
        if not is_list:
            return isinstance(value, item)
        return isinstance(value, list) and all(isinstance(x, item) for x in value)
    if isinstance(value, list):
        return len({type(x) for x in value}) <= 1 and all(isinstance(x, SCALARS) for x in value)
    return isinstance(value, SCALARS)


def coerce_to_type(value: str, data_type: Any = None) -> Any:
    """Read a text as a value of the type, by the rules of YAML where they matter.

    Parameters
    ----------
    value
        The text.
    data_type
        bool, int, float, str, a typing.List of one of them, or None for what YAML makes of it.

    Raises
    ------
    ValueError
        When the text is no such value.

    """
    if data_type is str or (data_type is None and not value):
        return value
    if data_type in (int, float):
        return data_type(value)
    if data_type is bool:
        value = {'0': 'false', '1': 'true'}.get(value, value)
    try:
        result = yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise ValueError(f"Failed to convert '{value}' using yaml rules: {error}") from error
    if not _is_valid(result, data_type):
        raise ValueError(f"Cannot convert value '{value}' to '{data_type or 'scalar or list'}'")
    return result


def normalize_typed_substitution(value: Any, data_type: Any) -> Any:
    """Check a value, and turn what is text to come into lists of substitutions.

    Raises
    ------
    TypeError
        When the value can't become one of the type.

    """
    if isinstance(value, SCALARS):
        if not _is_valid(value, data_type):
            raise TypeError(f"value='{value}' is not an instance of {data_type}")
        return value
    if is_substitution(value):
        return normalize_to_list_of_substitutions(value)
    if not isinstance(value, Iterable):
        raise TypeError(f"expected a value, a substitution or a list of them, got '{value}'")
    return _normalize_list(list(value), data_type)


def _normalize_list(values: list[Any], data_type: Any) -> list[Any]:
    given = [x for x in values if not is_substitution(x)]
    if any(type(x) is float for x in given) and all(type(x) in (int, float) for x in given):
        given = [float(x) for x in given]
    if not _is_valid(given, data_type):
        raise TypeError(f"value='{values}' is not a list of the type {data_type}")
    rest = iter(given)
    return [
        normalize_to_list_of_substitutions(x) if is_substitution(x) else next(rest) for x in values
    ]


def _is_text_to_come(x: Any) -> bool:
    return isinstance(x, list) and bool(x) and all(isinstance(i, Substitution) for i in x)


def perform_typed_substitution(context: LaunchContext, value: Any, data_type: Any) -> Any:
    """Return the value of a normalized typed substitution.

    Raises
    ------
    ValueError
        When the text is no value of the type.

    """
    if isinstance(value, SCALARS):
        return value
    if _is_text_to_come(value):
        return coerce_to_type(perform_substitutions(context, value), data_type)
    item = None if data_type is None else _item_type(data_type)[0]
    result = [
        coerce_to_type(perform_substitutions(context, x), item) if _is_text_to_come(x) else x
        for x in value
    ]
    if not _is_valid(result, data_type):
        raise ValueError(f"'{result}' is not a uniform list of the expected type {data_type}")
    return result

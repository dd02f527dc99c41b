"""Options of plan_scan, each from the field of a dataclass."""

import argparse
from collections.abc import Callable
from dataclasses import Field, replace
from typing import Any, get_args

from nodlidar_common.parameters import limits_of

_NAMED_OTHERWISE = {
    'object_size': '--object',
    'duration': '--time-budget, or hole_after of --objective,',
}
_KINDS = {int: ('N', 'a whole number'), float: ('X', 'a number'), str: ('TEXT', 'a text')}


def flag(name: str) -> str:
    """Return the option of a field, such as --pitch-min."""
    return _NAMED_OTHERWISE.get(name) or '--' + name.replace('_', '-')


def add_option(group: Any, option_field: 'Field[Any]') -> None:
    """Add the option of a dataclass field; the dataclass checks its range."""
    name, limits = option_field.name, limits_of(option_field)
    if option_field.type is bool:
        group.add_argument(flag(name), dest=name, action='store_true', help=limits.description)
        return
    kind: Any = next(iter(get_args(option_field.type)), option_field.type)
    metavar = limits.unit or _KINDS[kind][0]
    group.add_argument(
        flag(name),
        dest=name,
        type=_reader(kind),
        metavar=metavar,
        default=option_field.default,
        help=_help(option_field),
    )


def _help(option_field: 'Field[Any]') -> str:
    limits, default = limits_of(option_field), option_field.default
    text = limits.description
    if limits.minimum is not None:
        low, high = _short(limits.minimum), _short(limits.maximum)
        text += f'; {replace(limits, minimum=low, maximum=high).in_words()}'
    if default is not None:
        text += (
            f' [default: {default:.6g}]'
            if isinstance(default, float)
            else f' [default: {default}]'
        )
    return text.replace('%', '%%')


def _short(limit: float | None) -> float | None:
    return float(f'{limit:.6g}') if isinstance(limit, float) else limit


def _reader(kind: type[Any]) -> Callable[[str], Any]:
    """Return the function that converts an option's text; argparse prefixes its error."""

    def read(text: str) -> Any:
        try:
            return kind(text)
        except ValueError:
            message = f'must be {_KINDS[kind][1]}, but is {text!r}'
            raise argparse.ArgumentTypeError(message) from None

    return read

"""Parameters as frozen dataclasses: default, unit, range and description in one place.

A configuration is a frozen dataclass whose fields are calls of :func:`parameter`. The union of
several configurations inherits from them.

>>> @dataclass(frozen=True, slots=True)
... class Config:
...     rate: float = parameter(62.0, 'Joint states published per second', unit='Hz', minimum=1.0)
>>> check(Config(rate=0.5))
Traceback (most recent call last):
nodlidar_common.errors.ParameterError: 'rate' must be at least 1.0 Hz, but is 0.5
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, Field, field, fields
from difflib import get_close_matches
import math
from typing import Any

from nodlidar_common.errors import ParameterError

_KEY = 'nodlidar_parameter'
# Names at least this similar are taken for a misspelling; no two parameters of the nodes are.
_ALIKE = 0.85


@dataclass(frozen=True, slots=True)
class Limits:
    """Description and range of a parameter; ``live`` ones can change while the node runs."""

    description: str
    unit: str
    minimum: float | None
    maximum: float | None
    choices: tuple[str, ...]
    live: bool

    def in_words(self) -> str:
        """Return the allowed values as a phrase that follows 'must be'."""
        if self.choices:
            return 'one of ' + ', '.join(self.choices)
        unit = f' {self.unit}' if self.unit else ''
        if self.minimum is not None and self.maximum is not None:
            return f'between {self.minimum} and {self.maximum}{unit}'
        if self.minimum is not None:
            return f'at least {self.minimum}{unit}'
        if self.maximum is not None:
            return f'at most {self.maximum}{unit}'
        return 'a number'

    def allow(self, value: object) -> bool:
        """Return whether the value is within the limits; infinity and NaN never are."""
        if not _is_finite(value):
            return False
        if self.choices:
            return value in self.choices
        if isinstance(value, tuple):
            return all(map(self.allow, value))
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            above = self.minimum is None or value >= self.minimum
            below = self.maximum is None or value <= self.maximum
            return above and below
        return True


def parameter(
    default: Any,
    description: str,
    *,
    unit: str = '',
    minimum: float | None = None,
    maximum: float | None = None,
    choices: Sequence[str] = (),
    live: bool = False,
) -> Any:
    """Return a dataclass field that carries its own description, unit and range."""
    limits = Limits(description, unit, minimum, maximum, tuple(choices), live)
    return field(default=default, metadata={_KEY: limits})


def limits_of(config_field: 'Field[Any]') -> Limits:
    """Return the limits of a field of :func:`parameter`."""
    limits: Limits = config_field.metadata[_KEY]
    return limits


def type_in_words(config_field: 'Field[Any]') -> str:
    """Return the type of a field as a phrase that follows 'must be'."""
    default = config_field.default
    if isinstance(default, tuple):
        return f'a list of {type(default[0]).__name__}s'
    return f'of type {type(default).__name__}'


def check(config: Any) -> None:
    """Check every field's range, then run ``check_together`` of each class.

    Raises
    ------
    ParameterError
        If a field is out of range, or does not pass ``check_together``.
    """
    check_ranges(type(config), {each.name: getattr(config, each.name) for each in fields(config)})
    for each_class in reversed(type(config).__mro__):
        if 'check_together' in vars(each_class):
            vars(each_class)['check_together'](config)


def check_ranges(config_class: type[Any], values: Mapping[str, Any]) -> None:
    """Check the range of some fields of a configuration; raises ParameterError."""
    for config_field in fields(config_class):
        limits, name = limits_of(config_field), config_field.name
        if name in values and not limits.allow(values[name]):
            allowed = limits.in_words() if _is_finite(values[name]) else 'finite'
            raise ParameterError(name, allowed, values[name])


def _is_finite(value: object) -> bool:
    """Return whether a value contains neither infinity nor NaN."""
    if isinstance(value, tuple):
        return all(map(_is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


def misspelt(given: Collection[str], known: Collection[str], kind: str = 'parameter') -> list[str]:
    """Return a remark for each given name that is almost a known one.

    ROS ignores unknown parameters, since a file for several nodes has some of others.
    """
    close = {
        name: get_close_matches(name, known, n=1, cutoff=_ALIKE)
        for name in given
        if name not in known
    }
    return [
        f"there is no {kind} '{name}': is '{found[0]}' meant?"
        for name, found in close.items()
        if found
    ]

"""Declares a configuration dataclass as the parameters of a node."""

from collections.abc import Callable
from dataclasses import Field, fields, replace
from typing import Any, Generic, TypeVar

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, limits_of, misspelt, type_in_words
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

Config = TypeVar('Config')

_INTEGER_BOUND = 2**63 - 1


def descriptor(config_field: 'Field[Any]', read_only: bool) -> ParameterDescriptor:
    """Return the descriptor that `ros2 param describe` shows for a field."""
    limits = limits_of(config_field)
    text = f'{limits.description} [{limits.unit}]' if limits.unit else limits.description
    result = ParameterDescriptor(description=text, read_only=read_only)
    if limits.choices:
        result.additional_constraints = limits.in_words()
    if limits.minimum is None and limits.maximum is None:
        return result
    if isinstance(config_field.default, int):
        low = -_INTEGER_BOUND if limits.minimum is None else int(limits.minimum)
        high = _INTEGER_BOUND if limits.maximum is None else int(limits.maximum)
        result.integer_range = [IntegerRange(from_value=low, to_value=high, step=0)]
    else:
        low_f = float('-inf') if limits.minimum is None else limits.minimum
        high_f = float('inf') if limits.maximum is None else limits.maximum
        result.floating_point_range = [
            FloatingPointRange(from_value=low_f, to_value=high_f, step=0.0)
        ]
    return result


def declare(
    node: Node,
    config_class: type[Config],
    on_change: Callable[[Config], None] | None = None,
    defaults: Config | None = None,
    is_configured: Callable[[], bool] | None = None,
    check_change: Callable[[Config], None] | None = None,
) -> Config:
    """Declare every field of a configuration as a parameter and return the configuration.

    Parameters that the user did not set are as in `defaults`, or else the defaults of the class.
    Live parameters can be set while the node runs: `on_change` then receives the new
    configuration, after the same checks as the first one. The others are read-only, or, for a
    lifecycle node, which passes `is_configured`, can be set until it is configured. What
    `check_change` raises ParameterError for is refused.

    Raises
    ------
    ParameterError
        If a parameter has the wrong type, is out of range or contradicts another one.
    """
    defaults = config_class() if defaults is None else defaults
    values = {
        f.name: _declare_one(
            node, f, getattr(defaults, f.name), not limits_of(f).live and is_configured is None
        )
        for f in fields(config_class)  # type: ignore[arg-type]
    }
    config = config_class(**values)
    check(config)
    for remark in misspelt(node._parameter_overrides, values):
        node.get_logger().warning(remark)
    settable = _Settable(config, on_change, is_configured, check_change)
    node.add_on_set_parameters_callback(settable.validate)
    node.add_post_set_parameters_callback(settable.apply)
    return config


class _Settable(Generic[Config]):
    """The configuration that results as its parameters are set."""

    def __init__(
        self,
        config: Config,
        on_change: Callable[[Config], None] | None,
        is_configured: Callable[[], bool] | None,
        check_change: Callable[[Config], None] | None,
    ) -> None:
        self._check_change = check_change
        self._config, self._on_change, self._is_configured = config, on_change, is_configured
        self._fields = {f.name: f for f in fields(config)}  # type: ignore[arg-type]

    def validate(self, parameters: list[Parameter]) -> SetParametersResult:
        """Return whether parameters may be set, else why not."""
        try:
            new = self._changed(parameters)
            if self._is_configured is not None and self._is_configured():
                _check_live(self._config, new)
            if self._check_change is not None:
                self._check_change(new)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def apply(self, parameters: list[Parameter]) -> None:
        """Pass the configuration on if parameters have changed it."""
        new = self._changed(parameters)
        if new != self._config:
            self._config = new
            if self._on_change is not None:
                self._on_change(new)

    def _changed(self, parameters: list[Parameter]) -> Config:
        own = {
            p.name: _value(self._fields[p.name], p.value)
            for p in parameters
            if p.name in self._fields
        }
        new = replace(self._config, **own)  # type: ignore
        check(new)
        return new


def _check_live(old: Any, new: Any) -> None:
    """Raise ParameterError if a parameter that is not live has changed."""
    for each in fields(old):
        before, after = getattr(old, each.name), getattr(new, each.name)
        if before != after and not limits_of(each).live:
            limit = f'{before!r} until the node is deactivated and cleaned up'
            raise ParameterError(each.name, limit, after)


def _declare_one(node: Node, config_field: 'Field[Any]', default: Any, read_only: bool) -> Any:
    key = config_field.name
    try:
        value = node.declare_parameter(key, default, descriptor(config_field, read_only)).value
    except InvalidParameterTypeException as error:
        raise ParameterError(key, type_in_words(config_field), _override(node, key)) from error
    except InvalidParameterValueException as error:
        raise ParameterError(
            key, limits_of(config_field).in_words(), _override(node, key)
        ) from error
    return _value(config_field, value)


def _value(config_field: 'Field[Any]', value: Any) -> Any:
    """Return a parameter's value in the field's type: a tuple instead of a list.

    rclpy reads an empty list as no value.
    """
    if isinstance(config_field.default, tuple):
        return tuple(value or ())
    if value is None:
        raise ParameterError(config_field.name, type_in_words(config_field), [])
    return value


def _override(node: Node, key: str) -> object:
    """Return the value that the user set for a parameter that could not be declared."""
    override = node._parameter_overrides.get(key)
    return None if override is None else override.value

"""Values of ROS parameters."""

from typing import Any

from launch import LaunchContext, SomeSubstitutionsType
from launch.substitution import normalize, perform
from underlay_refusal import refuse
import yaml

__all__ = ['ParameterValue']
__getattr__ = refuse(__name__, __all__)


class ParameterValue:
    """A parameter's value that text becomes.

    Parameters
    ----------
    value
        The text.
    value_type
        str for the text itself, or None for what YAML makes of it.

    """

    def __init__(self, value: SomeSubstitutionsType, *, value_type: type | None = None) -> None:
        if value_type not in (None, str):
            raise NotImplementedError(f'value_type={value_type} is not covered, only str is')
        self._value = normalize(value)
        self._value_type = value_type

    def evaluate(self, context: LaunchContext) -> Any:
        """Return the value."""
        text = perform(context, self._value)
        return text if self._value_type is str or not text else yaml.safe_load(text)

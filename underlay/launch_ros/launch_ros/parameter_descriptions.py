"""Values of ROS parameters."""

from typing import Any

from launch import LaunchContext, SomeSubstitutionsType
from launch.substitution import is_substitution, normalize, perform
from underlay_refusal import Partial, refuse
import yaml

__all__ = ['ParameterValue']
__getattr__ = refuse(__name__, __all__)


class ParameterValue(Partial):
    """A parameter's value that text becomes.

    Parameters
    ----------
    value
        The text, as it is, or substitutions.
    value_type
        What substitutions become: str for the text itself, or None for what YAML makes of it.

    """

    def __init__(self, value: SomeSubstitutionsType, *, value_type: type | None = None) -> None:
        if value_type not in (None, str):
            raise NotImplementedError(f'value_type={value_type} is not covered, only str is')
        if not isinstance(value, str) and not is_substitution(value):
            raise NotImplementedError(f'a value of {value!r} is not covered, only text is')
        self._value = normalize(value)
        self._is_text = value_type is str or isinstance(value, str)

    def evaluate(self, context: LaunchContext) -> Any:
        """Return the value; ValueError for what no parameter can have."""
        text = perform(context, self._value)
        return text if self._is_text or not text else _from_yaml(text)


def _from_yaml(text: str) -> Any:
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        value = None
    if not is_value(value):
        raise ValueError(
            f'a parameter cannot have the value {text!r}; value_type=str makes it a text'
        )
    return value


def is_value(value: Any) -> bool:
    """Tell if a parameter can have a value: a truth, number or text, or a list of one kind."""
    kinds = {type(item) for item in (value if isinstance(value, list) else [value])}
    return len(kinds) == 1 and kinds <= {bool, int, float, str}

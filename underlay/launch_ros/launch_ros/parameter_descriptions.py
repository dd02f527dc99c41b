"""Values of ROS parameters."""

from dataclasses import dataclass

from underlay_refusal import Partial, refuse

__all__ = ['ParameterValue']
__getattr__ = refuse(__name__, __all__)


@dataclass(frozen=True)
class ParameterValue(Partial):
    """A parameter's value that stays text, with `value_type` str."""

    value: str
    value_type: type

    def __post_init__(self) -> None:
        if self.value_type is not str or not isinstance(self.value, str):
            raise NotImplementedError(f'{self} is not covered by the underlay, only text is')

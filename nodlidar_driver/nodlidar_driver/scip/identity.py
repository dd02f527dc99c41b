"""What a lidar reports about itself: the answers to VV, PP and II."""

from collections.abc import Mapping
from dataclasses import dataclass

from nodlidar_common.errors import DeviceError

_DIGITS = 9  # no number of a lidar has more


@dataclass(frozen=True, slots=True)
class Version:
    """The answer to VV."""

    vendor: str
    product: str
    firmware: str
    protocol: str
    serial_number: str


@dataclass(frozen=True, slots=True)
class Capabilities:
    """The answer to PP.

    Attributes
    ----------
    model
        Model name.
    range_min_mm, range_max_mm
        Measurable ranges [mm].
    steps_per_revolution
        N_L, steps of a full circle, dark ones included.
    first_step, last_step
        Steps that are measured.
    front_step
        Step along the x axis.
    speed
        Nominal speed [rpm].
    """

    model: str
    range_min_mm: int
    range_max_mm: int
    steps_per_revolution: int
    first_step: int
    last_step: int
    front_step: int
    speed: int

    @property
    def revolution(self) -> float:
        """Nominal time of one revolution [s]."""
        return 60.0 / self.speed

    @property
    def range_min(self) -> float:
        """Shortest measurable range [m]."""
        return self.range_min_mm * 1e-3

    @property
    def range_max(self) -> float:
        """Longest measurable range [m]."""
        return self.range_max_mm * 1e-3


@dataclass(frozen=True, slots=True)
class State:
    """The answer to II, as far as it is used: speed of the motor and health."""

    speed: str
    health: str


def version(information: Mapping[str, str]) -> Version:
    """Return the answer to VV; raises DeviceError if a key is missing."""
    return Version(
        vendor=_value(information, 'VEND'),
        product=_value(information, 'PROD'),
        firmware=_value(information, 'FIRM'),
        protocol=_value(information, 'PROT'),
        serial_number=_value(information, 'SERI'),
    )


def capabilities(information: Mapping[str, str]) -> Capabilities:
    """Return the answer to PP; raises DeviceError if a key is missing or not a number."""
    return Capabilities(
        model=_value(information, 'MODL'),
        range_min_mm=_number(information, 'DMIN'),
        range_max_mm=_number(information, 'DMAX'),
        steps_per_revolution=_number(information, 'ARES'),
        first_step=_number(information, 'AMIN', least=0),
        last_step=_number(information, 'AMAX'),
        front_step=_number(information, 'AFRT'),
        speed=_number(information, 'SCAN'),
    )


def state(information: Mapping[str, str]) -> State:
    """Return the answer to II; raises DeviceError if a key is missing."""
    return State(
        speed=_value(information, 'SCSP'),
        health=_value(information, 'STAT'),
    )


def _value(information: Mapping[str, str], key: str) -> str:
    if key not in information:
        raise DeviceError(f'the lidar does not report its {key}, only {", ".join(information)}')
    return information[key]


def _number(information: Mapping[str, str], key: str, least: int = 1) -> int:
    value = _value(information, key)
    if not value.isdecimal() or len(value) > _DIGITS or int(value) < least:
        allowed = f'a whole number from {least} on'
        raise DeviceError(f"the lidar's {key} must be {allowed}, but is {value!r}")
    return int(value)

"""Limits and N_s of a nod: what is commanded of it, but for its phase."""

from dataclasses import dataclass

from nodlidar_common.nod import Nod


@dataclass(frozen=True, slots=True)
class NodShape:
    """Limits [rad] and N_s of a nod.

    Raises
    ------
    ParameterError
        If they are not those of a nod.
    """

    pitch_min: float
    pitch_max: float
    samples_per_sweep: int

    def __post_init__(self) -> None:
        Nod(self.pitch_min, self.pitch_max, 1.0, self.samples_per_sweep, 0)

"""How much the positions of the joint scatter about its motion."""

import math

from nodlidar_assembler.clouds.white_noise import WhiteNoise
from nodlidar_assembler.plausibility.point_error import DISTANCE
import numpy as np

SCATTER = 4e-3  # that is named [rad]; the coarsest encoder rounds by 1.5e-3 RMS
_AT_ONCE = 100  # samples


class JointScatter:
    """Takes the samples of a joint, and says if they scatter a lot."""

    def __init__(self, joint_name: str) -> None:
        self._joint_name = joint_name
        self._noise = WhiteNoise()
        self._new: list[tuple[int, float]] = []
        self._last_ns: int | None = None

    def add(self, sample: tuple[int, float]) -> None:
        """Add a sample [ns], [rad]; one that was sent twice counts once."""
        if sample[0] == self._last_ns:
            return
        self._last_ns = sample[0]
        self._new.append(sample)
        if len(self._new) == _AT_ONCE:  # the noise is learned from the last samples only
            self._learned()

    @property
    def warning(self) -> str:
        """By how much positions scatter; empty if it is little."""
        scatter = self._learned()
        if scatter < SCATTER:
            return ''
        return (
            f"positions of '{self._joint_name}' scatter by {scatter * 1e3:.0f} mrad RMS, "
            f'points {DISTANCE:g} m away by {DISTANCE * scatter * 1e3:.0f} mm: '
            'the encoder is noisy, or positions are not stamped when they are measured'
        )

    def _learned(self) -> float:
        """Learn from the new samples; return the noise [rad]."""
        if self._new:
            times_ns, pitch = zip(*self._new, strict=True)
            self._noise.add(np.array(times_ns), np.array(pitch))
            self._new.clear()
        return math.sqrt(self._noise.variance())

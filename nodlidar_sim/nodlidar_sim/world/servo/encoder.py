"""The encoder: what the servo reads of its shaft."""

from __future__ import annotations

import math

from nodlidar_common.arrays import Array, Times
from nodlidar_sim.world.servo.parameters import ServoParameters
import numpy as np

_WEIGHTS = (0.6, 0.3, 0.1)  # of the harmonics of a turn
_SEEDS = 2**62 - 1
_BLOCK = 4096  # periods whose noise is drawn at once
MOST_BLOCKS = 8  # that are kept; others are drawn again


class Encoder:
    """Rounds the shaft's position to ticks, with a smooth error over the turn and noise.

    The noise of a period depends only on the seed and the period's number, so that readings are
    the same however often and in whichever order they are asked for.
    """

    def __init__(self, parameters: ServoParameters, seed: int) -> None:
        self._tick = parameters.tick
        self._noise = parameters.encoder_noise
        self._amplitudes = [w * parameters.encoder_nonlinearity for w in _WEIGHTS]
        self._seed = seed
        self._phases = np.random.default_rng([seed, 0]).uniform(0.0, math.tau, 3).tolist()
        self._blocks: dict[int, list[float]] = {}

    def reading(self, shaft: float, period: int) -> float:
        """Return the position [rad] that the servo reads at a period's start."""
        ticks = shaft / self._tick + self._error(shaft)
        if self._noise > 0.0:
            ticks += self._noise_of(period)
        return round(ticks) * self._tick

    def smooth(self, shaft: Array) -> Array:
        """Return the positions [rad] without steps and noise, with the smooth error."""
        harmonics = zip(self._amplitudes, self._phases, strict=True)
        error = sum(
            amplitude * np.sin(number * shaft + phase)
            for number, (amplitude, phase) in enumerate(harmonics, 1)
        )
        return np.asarray(shaft + self._tick * error)

    def readings(self, shaft: Array, periods: Times) -> Array:
        """Return the positions [rad] read in periods, same shape."""
        pairs = zip(shaft.ravel().tolist(), periods.ravel().tolist(), strict=True)
        return np.array([self.reading(*pair) for pair in pairs]).reshape(shaft.shape)

    def _error(self, shaft: float) -> float:
        """Return the smooth error [ticks]."""
        if self._amplitudes[0] == 0.0:
            return 0.0
        first, second, third = self._amplitudes
        one, two, three = self._phases
        return (
            first * math.sin(shaft + one)
            + second * math.sin(2.0 * shaft + two)
            + third * math.sin(3.0 * shaft + three)
        )

    def _noise_of(self, period: int) -> float:
        """Return the noise of a period [ticks]."""
        block, place = divmod(period, _BLOCK)
        if block not in self._blocks:
            if len(self._blocks) == MOST_BLOCKS:
                del self._blocks[next(iter(self._blocks))]
            rng = np.random.default_rng([self._seed, 1, block & _SEEDS])  # times before 0, too
            self._blocks[block] = rng.normal(0.0, self._noise, _BLOCK).tolist()
        return self._blocks[block][place]

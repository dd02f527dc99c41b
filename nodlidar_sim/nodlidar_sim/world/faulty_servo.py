"""A servo that does not do as it is told, or does not say where it is, for tests of its hosts."""

from nodlidar_sim.world.ideal_servo import IdealServo
import numpy as np


class FaultyServo(IdealServo):
    """A servo whose motor and encoder can fail; its motion is the true one.

    Parameters
    ----------
    seed
        Of the random readings.
    position, history
        As of IdealServo [rad], [s].

    Attributes
    ----------
    blocked
        Whether the motor cannot move it.
    frozen
        Reading of the encoder [rad]; None for the true position.
    spike_rate
        Share of the readings that are random.
    first_hit_ns
        When a fault first had an effect [ns]; None if none had.
    """

    def __init__(self, seed: int = 0, position: float = 0.0, history: float = 5.0) -> None:
        super().__init__(position, history=history)
        self._rng = np.random.default_rng(seed)
        self.mend()

    def mend(self) -> None:
        """End all faults."""
        self.blocked = False
        self.frozen: float | None = None
        self.spike_rate = 0.0
        self.first_hit_ns: int | None = None

    def measured(self, now_ns: int) -> tuple[float, float]:
        """Return the readings of the encoder [rad] and of the speed register [rad/s]."""
        position, velocity = super().measured(now_ns)
        if self.frozen is not None:
            self._hit(now_ns)
            return self.frozen, 0.0
        if self.spike_rate and self._rng.random() < self.spike_rate:
            self._hit(now_ns)
            return self._rng.uniform(-2.6, 2.6), velocity
        return position, velocity

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Go to an angle [rad] at a speed [rad/s], unless it is blocked."""
        if self.blocked:
            self._hit(now_ns)
            self.brake(now_ns)
        else:
            super().set_goal(now_ns, goal, speed_limit)

    def _hit(self, now_ns: int) -> None:
        if self.first_hit_ns is None:
            self.first_hit_ns = now_ns

"""Refuses positions that the servo cannot have reached."""

from nodlidar_common.nod import NS_PER_S
from nodlidar_servo.bus.replies import PositionError
from nodlidar_servo.models.models import ServoModel

_SLACK_TICKS = 2
_STRONGER = 1.5  # times the configured acceleration
_FASTER = 1.2  # times the speed of the model: a higher supply, a pulling load


class PositionCheck:
    """Refuses positions that the servo cannot have.

    From one position to the next a servo keeps its velocity or slows down, apart from what 1.5
    times its acceleration can change in this time, and some ticks. The range grows with
    time, so that after a lasting jump (the shaft was turned by hand) positions are accepted again
    within 0.2 s.

    Parameters
    ----------
    model
        The servo's model.
    acceleration
        Highest acceleration that it may reach [rad/s^2].
    """

    def __init__(self, model: ServoModel, acceleration: float) -> None:
        self._model = model
        self._acceleration = acceleration
        self._last: tuple[int, float] | None = None
        self._velocity = 0.0

    def accept(self, time_ns: int, tick: int) -> None:
        """Accept a position at a time [ns].

        Raises
        ------
        PositionError
            If the model has no such position, or the servo cannot be there.
        """
        if not 0 <= tick < self._model.ticks:
            raise PositionError(
                f'the servo reports position {tick}, but has 0..{self._model.ticks - 1}'
            )
        angle = tick * self._model.tick_angle
        if self._last is not None and time_ns > self._last[0]:
            elapsed, way = (time_ns - self._last[0]) / NS_PER_S, angle - self._last[1]
            self._check_way(way, elapsed)
            fastest = _FASTER * self._model.max_speed
            self._velocity = min(max(way / elapsed, -fastest), fastest)
        self._last = time_ns, angle

    def _check_way(self, way: float, elapsed: float) -> None:
        change = _STRONGER * self._acceleration * elapsed**2
        slack = change + _SLACK_TICKS * self._model.tick_angle
        expected = self._velocity * elapsed
        if not min(expected, 0.0) - slack <= way <= max(expected, 0.0) + slack:
            raise PositionError(
                f'the servo reports a position {way:.2f} rad from that of'
                f' {elapsed * 1e3:.0f} ms before, which it cannot have reached'
            )

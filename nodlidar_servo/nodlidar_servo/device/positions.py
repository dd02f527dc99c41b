"""Refuses positions that the servo cannot have."""

from nodlidar_servo.bus.replies import PositionError
from nodlidar_servo.models.models import ServoModel
from nodlidar_servo.nod.reach import ReachCheck, ReachError

_SLACK_TICKS = 2


class PositionCheck:
    """Refuses positions that the model does not have, or that the servo cannot have reached.

    After a lasting jump they are accepted again within 0.2 s.

    Parameters
    ----------
    model
        The servo's model.
    acceleration
        Highest acceleration that it may reach [rad/s^2].
    """

    def __init__(self, model: ServoModel, acceleration: float) -> None:
        self._model = model
        self._reach = ReachCheck(acceleration, model.max_speed, _SLACK_TICKS * model.tick_angle)

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
        try:
            self._reach.accept(time_ns, tick * self._model.tick_angle)
        except ReachError as error:
            raise PositionError(f'the servo reports {error}') from None

"""Refuses positions that a joint cannot have reached."""

from nodlidar_common.errors import DeviceError
from nodlidar_common.stamps import NS_PER_S

_STRONGER = 1.5  # times the configured acceleration
_FASTER = 1.2  # times the highest speed: a higher supply, a pulling load


class ReachError(DeviceError):
    """A position that the joint cannot have reached from the one before."""


class ReachCheck:
    """Refuses positions that a joint cannot have reached from the one accepted before.

    From one position to the next a joint keeps its velocity or slows down, apart from what 1.5
    times its acceleration can change in this time, and a slack. The range grows with time, so that
    after a lasting jump (the shaft was turned by hand) positions are accepted again.

    Parameters
    ----------
    acceleration, max_speed
        The highest that it may reach [rad/s^2], [rad/s].
    slack
        Error of a way [rad].

    Attributes
    ----------
    fastest
        No velocity is higher [rad/s].
    velocity
        Mean velocity between the last two accepted positions [rad/s], at most `fastest`.
    """

    def __init__(self, acceleration: float, max_speed: float, slack: float) -> None:
        self.fastest = _FASTER * max_speed
        self._strongest, self._slack = _STRONGER * acceleration, slack
        self.restart()

    def restart(self) -> None:
        """Accept any next position."""
        self._last: tuple[int, float] | None = None
        self.velocity = 0.0

    def accept(self, time_ns: int, position: float) -> None:
        """Accept a position [rad] at a time [ns].

        Raises
        ------
        ReachError
            If the joint cannot be there.
        """
        if self._last is not None and time_ns > self._last[0]:
            elapsed, way = (time_ns - self._last[0]) / NS_PER_S, position - self._last[1]
            self._check_way(way, elapsed)
            self.velocity = min(max(way / elapsed, -self.fastest), self.fastest)
        self._last = time_ns, position

    def _check_way(self, way: float, elapsed: float) -> None:
        slack = self._strongest * elapsed**2 + self._slack
        expected = self.velocity * elapsed
        if not min(expected, 0.0) - slack <= way <= max(expected, 0.0) + slack:
            raise ReachError(
                f'a position {way:.2f} rad from that of {elapsed * 1e3:.0f} ms before, which it'
                ' cannot have reached'
            )

"""Checks whether the servo follows its commands, which `nodlidar_common.tracking` makes."""

from collections import deque
import math

from nodlidar_common.nod import Nod
from nodlidar_common.phase import LOCKED
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.tracking import Drive, Measured
from nodlidar_servo.device.config import ServoConfig

RETRY = 1.5
"""Time [s] for which the torque stays off before the next attempt."""

_STEP = 0.005  # s, of the model
_LONGEST = 10.0  # s; after this time without a command the servo is at its goal
_DELAY = 0.02  # s, lateness of the servo that is allowed: adapter, host
_SHARE = 1.0 / 6.0  # of the span: a servo blocked in mid-span is mostly farther away
_LEAST = 0.016  # rad, three ticks
_FADING = 0.98  # of the highest speed by each cycle, since its effect lasts
_OTHER_SPEED = 0.1  # share by which the speed of another nod differs; tuning is less
_APPROACH = 0.1  # of its speed, by which the model approaches the servo: errors do not add up
_WITHIN = 0.25  # s within the limit after which a servo follows and is not just passing
_STANDING = 0.05  # s
_DOUBTED = 0.02  # rad that the model moves while a servo that is believed stands still


class ModelMotor:
    """Model of a servo with a given acceleration [rad/s^2] that follows its commands.

    Attributes
    ----------
    pitch, velocity
        [rad] and [rad/s].
    """

    def __init__(self, acceleration: float, time_ns: int, pitch: float, velocity: float) -> None:
        self.pitch, self.velocity = pitch, velocity
        self._acceleration = acceleration
        self._time_ns = time_ns
        self._goal, self._speed = pitch, 0.0

    def command(self, drive: Drive) -> None:
        """Set goal and speed."""
        self._goal, self._speed = drive.goal, drive.speed

    def advance(self, time_ns: int) -> None:
        """Advance to a time [ns]."""
        remaining = min((time_ns - self._time_ns) / NS_PER_S, _LONGEST)
        self._time_ns = time_ns
        while remaining > 0.0:
            self._step(min(remaining, _STEP))
            remaining -= _STEP

    def approach(self, pitch: float, duration: float) -> None:
        """Move slowly towards a pitch [rad], for a duration [s]."""
        most = _APPROACH * abs(self.velocity) * duration
        self.pitch += min(max(pitch - self.pitch, -most), most)

    def _step(self, duration: float) -> None:
        way = self._goal - self.pitch
        fastest = min(self._speed, math.sqrt(2.0 * self._acceleration * abs(way)))
        change = self._acceleration * duration
        wanted = math.copysign(min(fastest, abs(way) / duration), way)
        self.velocity = min(max(wanted, self.velocity - change), self.velocity + change)
        self.pitch += self.velocity * duration


class Following:
    """Compares a servo with a model of it; a servo that stays away from the model is at fault.

    A servo at fault loses its torque. Every RETRY there is another attempt; the fault ends when
    the servo has moved as commanded.

    Parameters
    ----------
    config
        Has the largest distance between servo and model, and how long it may be exceeded.

    Attributes
    ----------
    fault
        The fault in words; empty without one.
    believed
        Whether the measured positions are believed: not while the servo stands still although it
        is commanded to move, since its encoder may be frozen.
    """

    def __init__(self, config: ServoConfig) -> None:
        self.fault = ''
        self.believed = True
        self._config = config
        self._model: ModelMotor | None = None
        self._nod: Nod | None = None
        self._fastest = 0.0
        self._allowed = math.inf
        self._away_since_ns: int | None = None
        self._last_away_ns = 0
        self._retry_ns = 0
        self._moved_ns, self._moved_to = 0, math.nan
        # The model's pitch [rad] at each time [ns] of the last LOCKED.
        self._lately: deque[tuple[int, float]] = deque()
        self._model_then = math.nan  # its pitch when the servo moved last
        self._measured_ns = 0
        self._range = math.inf, -math.inf

    def may_drive(self, now_ns: int) -> bool:
        """Return whether the servo may have torque at a steady time [ns]."""
        return not self.fault or now_ns >= self._retry_ns

    def rest(self) -> None:
        """Note that the servo is not driven: no position is a fault."""
        self._model = self._away_since_ns = None

    def forget(self) -> None:
        """Note that the servo has no command: it is not at fault, and is believed."""
        self.rest()
        self.fault, self.believed = '', True

    def drive(self, now_ns: int, drive: Drive, nod: Nod, sample: Measured) -> None:
        """Note the command to the servo at a steady time [ns], and the nod that it follows."""
        if self._model is None:
            self._last_away_ns, self._range = now_ns, (sample.pitch, sample.pitch)
        # An error within the limit of one nod may exceed that of another: restart the model.
        if self._model is None or self._nod is None or _is_another(nod, self._nod):
            self._model = ModelMotor(
                self._config.acceleration, now_ns, sample.pitch, sample.velocity
            )
            self._lately.clear()
            self._nod = nod
            self._model_then = sample.pitch
        self._fastest = max(drive.speed, _FADING * self._fastest, nod.speed)
        limit = max(min(self._config.following_error, _SHARE * nod.span), _LEAST)
        self._allowed = limit + _DELAY * self._fastest
        self._model.advance(now_ns)
        self._model.command(drive)

    def measured(self, now_ns: int, pitch: float) -> None:
        """Compare a pitch [rad], measured at a steady time [ns], with the model."""
        model_pitch = math.nan
        if self._model is not None:
            self._model.advance(now_ns)
            self._model.approach(pitch, min((now_ns - self._measured_ns) / NS_PER_S, _WITHIN))
            model_pitch = self._model.pitch
        self._measured_ns = now_ns
        if not abs(pitch - self._moved_to) < _LEAST / 2.0:
            self._moved_ns, self._moved_to, self._model_then = now_ns, pitch, model_pitch
            self.believed = True
        elif abs(model_pitch - self._model_then) > _DOUBTED:
            self.believed = False
        if self._model is not None:
            self._compare(now_ns, pitch)

    def _compare(self, now_ns: int, pitch: float) -> None:
        assert self._model is not None
        self._range = min(self._range[0], pitch), max(self._range[1], pitch)
        error = self._error(now_ns, pitch)
        if abs(error) > self._allowed:
            self._away(now_ns, error)
        elif now_ns - self._last_away_ns > _WITHIN * NS_PER_S:
            self._away_since_ns = None
            if self._range[1] - self._range[0] >= self._allowed:
                self.fault = ''

    def _error(self, now_ns: int, pitch: float) -> float:
        """Return how far the model is ahead [rad]; a servo that moves may be LOCKED late."""
        assert self._model is not None
        self._lately.append((now_ns, self._model.pitch))
        while self._lately[0][0] < now_ns - LOCKED * NS_PER_S:
            self._lately.popleft()
        if self._stands(now_ns):
            return self._model.pitch - pitch
        lately = [each for _, each in self._lately]
        return max(min(lately) - pitch, 0.0) + min(max(lately) - pitch, 0.0)

    def _stands(self, now_ns: int) -> bool:
        return now_ns - self._moved_ns > _STANDING * NS_PER_S

    def _away(self, now_ns: int, error: float) -> None:
        if self._away_since_ns is None:
            self._away_since_ns = now_ns
        self._last_away_ns = now_ns
        if now_ns - self._away_since_ns > self._config.following_error_time * NS_PER_S:
            how = 'stands still' if self._stands(now_ns) else 'moves differently'
            self.fault = self.fault or (
                f'the servo does not follow: it {how}, {abs(error):.2f} rad from the commanded '
                f'pitch; torque off, trying again every {RETRY:g} s'
            )
            self._retry_ns = now_ns + round(RETRY * NS_PER_S)
            self.rest()


def _is_another(nod: Nod, former: Nod) -> bool:
    limits = max(abs(nod.pitch_min - former.pitch_min), abs(nod.pitch_max - former.pitch_max))
    return limits > _LEAST or abs(nod.speed - former.speed) > _OTHER_SPEED * former.speed

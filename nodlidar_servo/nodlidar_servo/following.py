"""Whether the servo goes where it is told to, and what is done if it does not."""

import math

from nodlidar_common.nod import NodTrajectory, NS_PER_S
from nodlidar_servo.config import ServoConfig
from nodlidar_servo.tracking import Drive, Measured

RETRY = 1.5
"""Time [s] for which the torque stays off before the servo is tried again."""

_STEP = 0.005  # s, of the model
_LONGEST = 10.0  # s; a servo that was told nothing for so long is at its goal
_DELAY = 0.02  # s, by which a servo may be late: an adapter, a host
_SHARE = 1.0 / 6.0  # of the span: a servo that is blocked in mid-span is beyond it mostly
_LEAST = 0.016  # rad, three ticks
_FADING = 0.98  # of the highest speed by each cycle, since what it led to takes time
_OTHER_SPEED = 0.1  # share by which the speed of another nod differs; less is tuning
_GIVING = 0.1  # of its speed, by which the model comes back to the servo: errors do not add up
_WITHIN = 0.25  # s, within the limit after which a servo follows; less is passing by
_STANDING = 0.05  # s
_DOUBTED = 0.02  # rad; a servo that stands still while the model goes so far is not believed


class ModelMotor:
    """Where a servo with a given acceleration [rad/s^2] is, that does as it is told.

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

    def tell(self, drive: Drive) -> None:
        """Go to another goal or at another speed from now on."""
        self._goal, self._speed = drive.goal, drive.speed

    def advance(self, time_ns: int) -> None:
        """Go on until a time [ns]."""
        remaining = min((time_ns - self._time_ns) / NS_PER_S, _LONGEST)
        self._time_ns = time_ns
        while remaining > 0.0:
            self._step(min(remaining, _STEP))
            remaining -= _STEP

    def give_way(self, pitch: float, duration: float) -> None:
        """Come nearer to a pitch [rad] in so much time [s]."""
        most = _GIVING * abs(self.velocity) * duration
        self.pitch += min(max(pitch - self.pitch, -most), most)

    def _step(self, duration: float) -> None:
        way = self._goal - self.pitch
        fastest = min(self._speed, math.sqrt(2.0 * self._acceleration * abs(way)))
        change = self._acceleration * duration
        wanted = math.copysign(min(fastest, abs(way) / duration), way)
        self.velocity = min(max(wanted, self.velocity - change), self.velocity + change)
        self.pitch += self.velocity * duration


class Following:
    """Compares a servo with a model of it, and faults it if it stays away for long.

    A servo that faults loses its torque. It is tried again every RETRY; the fault lasts until it
    has moved as told.

    Parameters
    ----------
    config
        Says how far the servo may be from the model, and for how long farther.

    Attributes
    ----------
    fault
        What is wrong, in words; empty if nothing is.
    believed
        Whether the measured positions are: not while the servo stands still where it is told to
        move, which may be its encoder only.
    """

    def __init__(self, config: ServoConfig) -> None:
        self.fault = ''
        self.believed = True
        self._config = config
        self._model: ModelMotor | None = None
        self._nod: NodTrajectory | None = None
        self._fastest = 0.0
        self._allowed = math.inf
        self._off_since_ns: int | None = None
        self._last_off_ns = 0
        self._retry_ns = 0
        self._moved_ns, self._moved_to = 0, math.nan
        self._model_then = math.nan  # its pitch when the servo moved last
        self._measured_ns = 0
        self._range = math.inf, -math.inf

    def may_drive(self, now_ns: int) -> bool:
        """Tell whether the servo may have torque at a steady time [ns]."""
        return not self.fault or now_ns >= self._retry_ns

    def rest(self) -> None:
        """Take note that the servo is told nothing: wherever it is, that is no fault."""
        self._model = self._off_since_ns = None

    def drive(self, now_ns: int, drive: Drive, nod: NodTrajectory, sample: Measured) -> None:
        """Take note of what the servo is told at a steady time [ns], for which nod."""
        if self._model is None:
            self._last_off_ns, self._range = now_ns, (sample.pitch, sample.pitch)
        # What adds up under one nod may be too much for another: that begins anew.
        if self._model is None or self._nod is None or _is_another(nod, self._nod):
            self._model = ModelMotor(
                self._config.acceleration, now_ns, sample.pitch, sample.velocity
            )
            self._nod = nod
            self._model_then = sample.pitch
        self._fastest = max(drive.speed, _FADING * self._fastest, nod.speed)
        limit = max(min(self._config.following_error, _SHARE * nod.span), _LEAST)
        self._allowed = limit + _DELAY * self._fastest
        self._model.advance(now_ns)
        self._model.tell(drive)

    def measured(self, now_ns: int, pitch: float) -> None:
        """Compare a pitch [rad] that was measured at a steady time [ns] with the model."""
        model_pitch = math.nan
        if self._model is not None:
            self._model.advance(now_ns)
            self._model.give_way(pitch, min((now_ns - self._measured_ns) / NS_PER_S, _WITHIN))
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
        error = self._model.pitch - pitch
        if abs(error) > self._allowed:
            self._off(now_ns, error)
        elif now_ns - self._last_off_ns > _WITHIN * NS_PER_S:
            self._off_since_ns = None
            if self._range[1] - self._range[0] >= self._allowed:
                self.fault = ''

    def _off(self, now_ns: int, error: float) -> None:
        if self._off_since_ns is None:
            self._off_since_ns = now_ns
        self._last_off_ns = now_ns
        stands = now_ns - self._moved_ns > _STANDING * NS_PER_S
        if now_ns - self._off_since_ns > self._config.following_error_time * NS_PER_S:
            how = 'stands still' if stands else 'moves otherwise'
            self.fault = self.fault or (
                f'the servo does not follow: it {how}, {abs(error):.2f} rad from where it is told '
                f'to be; torque off, trying again every {RETRY:g} s'
            )
            self._retry_ns = now_ns + round(RETRY * NS_PER_S)
            self.rest()


def _is_another(nod: NodTrajectory, former: NodTrajectory) -> bool:
    limits = max(abs(nod.pitch_min - former.pitch_min), abs(nod.pitch_max - former.pitch_max))
    return limits > _LEAST or abs(nod.speed - former.speed) > _OTHER_SPEED * former.speed

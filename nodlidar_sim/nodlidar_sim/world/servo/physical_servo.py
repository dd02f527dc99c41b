"""The motion of a servo by physics, integrated as far as it is asked for."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.servo.encoder import Encoder
from nodlidar_sim.world.servo.firmware import check_goal, Compliance, Firmware, Loop
from nodlidar_sim.world.servo.parameters import PERIOD, ServoParameters
from nodlidar_sim.world.servo.plant import Bodies, Plant
import numpy as np

Number = TypeVar('Number', float, Array)

PERIOD_NS = round(PERIOD * NS_PER_S)
_IDLE = 10_000  # periods without torque, beyond which those at rest are skipped
_STILL = (1e-12, 1e-9, 1e-12, 1e-9)  # change of Bodies in a period, below which they rest
_SHAFT, _LIDAR = 0, 2  # places in Bodies


class State(NamedTuple):
    """Motion and firmware at the start of a period; warmth [K], and torque of the motor [Nm]."""

    motion: Bodies
    loop: Loop
    warmth: float
    torque: float


class PhysicalServo:
    """A servo with the interface of IdealServo; the pitch is the lidar's, behind the backlash.

    It rests until its first command. Commands take effect at the next period of the firmware, on
    multiples of 1 ms. What it does depends on the commands alone, not on when it is asked.

    Parameters
    ----------
    parameters
        Of servo and load.
    position
        Initial pitch of shaft and lidar [rad].
    seed
        Of the encoder's errors.
    history
        For which the past is kept [s]; earlier times raise ParameterError.
    """

    def __init__(
        self,
        parameters: ServoParameters,
        position: float = 0.0,
        seed: int = 0,
        history: float = 5.0,
    ) -> None:
        self.parameters = parameters
        self._plant = Plant(parameters)
        self._firmware = Firmware(parameters)
        self._encoder = Encoder(parameters, seed)
        self._kept = history / PERIOD
        self._first: int | None = None  # number of the first period in _states
        rest = (position, 0.0, position, 0.0)
        self._states = [State(rest, (position, 0.0, 0.0), 0.0, 0.0)]
        self._since_ever = True  # _states begins with the rest before the first command
        self._target: tuple[float, float] | None = None

    def position(self, times_ns: Times) -> Array:
        """Return the pitch of the lidar [rad] at each time [ns]."""
        return self._interpolated(times_ns, _LIDAR)[0]

    def velocity(self, times_ns: Times) -> Array:
        """Return the speed of the lidar [rad/s] at each time [ns]."""
        return self._interpolated(times_ns, _LIDAR)[1]

    def shaft_position(self, times_ns: Times) -> Array:
        """Return the pitch of the shaft [rad], before the backlash, at each time [ns]."""
        return self._interpolated(times_ns, _SHAFT)[0]

    def shaft_velocity(self, times_ns: Times) -> Array:
        """Return the speed of the shaft [rad/s] at each time [ns]."""
        return self._interpolated(times_ns, _SHAFT)[1]

    def encoder(self, times_ns: Times) -> Array:
        """Return the pitch [rad] that the encoder reports at each time [ns], in whole ticks."""
        times = np.asarray(times_ns, dtype=np.int64)
        return self._encoder.readings(self.shaft_position(times), times // PERIOD_NS)

    def smooth_encoder(self, times_ns: Times) -> Array:
        """Return the pitch [rad] that an encoder without steps and noise would report."""
        return self._encoder.smooth(self.shaft_position(times_ns))

    def measured(self, now_ns: int) -> tuple[float, float]:
        """Return pitch by the encoder [rad] and speed of the shaft [rad/s] at a time [ns]."""
        period = now_ns // PERIOD_NS
        self._advance(period + 1)
        index = self._index(period)
        rests = self._first is None or period < self._first
        begin = self._states[index].motion
        end = begin if rests else self._states[index + 1].motion
        part = (now_ns - period * PERIOD_NS) / PERIOD_NS
        shaft, speed = _hermite(part, begin[0], end[0], begin[1], end[1])
        return self._encoder.reading(shaft, period), speed

    def load(self, now_ns: int) -> float:
        """Return the torque of the motor as a share of that at standstill, -1 to 1."""
        self._advance(-(-now_ns // PERIOD_NS))
        state = self._states[self._index(now_ns // PERIOD_NS)]
        return min(max(state.torque / self.parameters.standstill_torque, -1.0), 1.0)

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Move to a pitch [rad] and hold it, from a time [ns] on, at a limited speed [rad/s].

        Raises
        ------
        ParameterError
            If the goal is not finite, the speed limit not positive, or the time too long ago.
        """
        check_goal(goal, speed_limit)
        self._change(now_ns)
        if self._target is None:
            last = self._states[-1]
            self._states[-1] = last._replace(loop=(last.motion[_SHAFT], 0.0, 0.0))
        self._target = goal, speed_limit

    def reach(self, now_ns: int, end_ns: int, position: float, velocity: float) -> None:
        """Move to the tick next to a pitch [rad] as fast as the position loop can, from a time on.

        The loop knows neither the end [ns] nor the velocity [rad/s] there, so the servo lags.
        """
        tick = self.parameters.tick
        self.set_goal(now_ns, round(position / tick) * tick, math.inf)

    def brake(self, now_ns: int) -> None:
        """Switch the torque off, from a time [ns] on."""
        self._change(now_ns)
        self._target = None

    def set_compliance(self, now_ns: int, registers: Compliance) -> None:
        """Apply the registers that shape the position loop, from a time [ns] on."""
        self._change(now_ns)
        self._firmware.set_compliance(registers)

    def _change(self, now_ns: int) -> None:
        """Drop what follows the period in which a command takes effect."""
        period = -(-now_ns // PERIOD_NS)
        if self._first is None:
            self._first = period
        self._advance(period)
        del self._states[self._index(period) + 1 :]

    def _index(self, period: int) -> int:
        """Return the place of a period in the history; raises ParameterError before it."""
        if self._first is None or (self._since_ever and period < self._first):
            return 0
        if period < self._first:
            limit = f'at or after {self._first * PERIOD_NS} ns, the start of the history'
            raise ParameterError('times_ns', limit, period * PERIOD_NS)
        return period - self._first

    def _advance(self, period: int) -> None:
        """Integrate up to the start of a period, after dropping what is older than the history."""
        if self._first is None:
            return
        if len(self._states) > 2 * self._kept:
            self._drop(len(self._states) - math.ceil(self._kept))
        last = self._first + len(self._states) - 1
        idle = self._target is None and period - last > max(_IDLE, self._kept)
        state = self._states[-1]
        for number in range(last, period):
            before, state = state, self._next(state, number)
            self._states.append(state)
            left = period - number - 1
            if idle and left and _is_still(before.motion, state.motion):
                self._rest(left)
                break

    def _rest(self, periods: int) -> None:
        """Stay where the bodies are for some periods."""
        last = self._states[-1]
        cooled = last.warmth * math.exp(-periods * PERIOD / self.parameters.warming_time)
        rested, history = last._replace(warmth=cooled), math.ceil(self._kept) + 1
        if periods < history:
            self._states += [rested] * periods
        else:
            self._drop(len(self._states) + periods - history)
            self._states = [rested] * history

    def _drop(self, periods: int) -> None:
        """Forget the oldest periods."""
        assert self._first is not None
        del self._states[:periods]
        self._first += periods
        self._since_ever = False

    def _next(self, state: State, period: int) -> State:
        duty, loop = None, state.loop
        if self._target is not None:
            reading = self._encoder.reading(state.motion[_SHAFT], period)
            duty, loop = self._firmware.step(loop, reading, *self._target)
        plant, warmth = self._plant, state.warmth
        motion = plant.advance(state.motion, duty, warmth)
        p = self.parameters
        if p.warming > 0.0:
            hot = plant.resistance(warmth)
            loss = hot * (plant.torque / p.kt) ** 2
            warmth += (loss * p.warming - warmth) * PERIOD / p.warming_time
        return State(motion, loop, warmth, plant.torque)

    def _interpolated(self, times_ns: Times, body: int) -> tuple[Array, Array]:
        """Return position and velocity of a body at times [ns]: cubic within a period.

        The cubic has position and velocity of both ends (Hermite), so both are continuous.
        """
        times = np.asarray(times_ns, dtype=np.int64)
        periods = times // PERIOD_NS
        if self._first is None or times.size == 0:
            motion = self._states[0].motion
            return np.full(times.shape, motion[body]), np.zeros(times.shape)
        periods = np.maximum(periods, self._first) if self._since_ever else periods
        self._advance(int(periods.max()) + 1)
        begin, end = self._index(int(periods.min())), self._index(int(periods.max())) + 2
        rows = [state.motion[body : body + 2] for state in self._states[begin:end]]
        positions, velocities = np.array(rows).T
        at = periods - (self._first + begin)
        part = np.maximum(times - periods * PERIOD_NS, 0) / PERIOD_NS
        return _hermite(part, positions[at], positions[at + 1], velocities[at], velocities[at + 1])


def _is_still(before: Bodies, after: Bodies) -> bool:
    """Return whether a period changed nothing, as at rest or pressed against a stop."""
    return all(abs(b - a) < most for b, a, most in zip(before, after, _STILL, strict=True))


def _hermite(
    part: Number, begin: Number, end: Number, begin_speed: Number, end_speed: Number
) -> tuple[Number, Number]:
    """Return position and velocity at a part of the period, of the cubic through both ends."""
    rise = (end - begin) / PERIOD
    bend = begin_speed + end_speed - 2.0 * rise
    slope = 3.0 * rise - 2.0 * begin_speed - end_speed
    position = begin + PERIOD * part * (begin_speed + part * (slope + part * bend))
    return position, begin_speed + part * (2.0 * slope + 3.0 * part * bend)

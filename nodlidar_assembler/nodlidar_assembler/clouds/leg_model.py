"""The pitch of every beam from a model of the nod, fitted to the joint samples around the scan.

The nod is legs of constant speed, joined at the reversals by parabolas of one acceleration A:

    pitch(t) = p + v t + sum_k c_k s(t - t_k; h_k),   h_k = |c_k| / (2 A),
    s(u; h) = 0 before -h,  (u + h)^2 / (4 h) up to h,  u after it.

Turn k changes the speed by c_k about its instant t_k. All of p, v, c, t and A are fitted by least
squares, so that the encoder's rounding averages out over the samples of a leg, and a reversal
is known although hardly two samples fall in it. The limits are not asked for: each leg may have
its own speed, and turn where it likes.
"""

import math

from nodlidar_common.errors import NodlidarError
from nodlidar_common.nod import NS_PER_S
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Where the fit begins, of an unloaded RX-24F [rad/s2]; the samples of a reversal outweigh it.
ACCELERATION = 200.0
ACCELERATION_SPREAD = math.log(4.0)  # standard deviation of its logarithm
ACCELERATION_RANGE = math.log(100.0)  # its logarithm never gets farther away from the start
ITERATIONS = 8  # of Gauss-Newton, which takes three or four unless the motion is another one
SETTLED = 2e-3  # change of the fitted samples that is none [encoder steps]
DAMPING = 1e-3  # keeps it from moving what the samples do not tell
TURN_DEPTH = 4.0  # way back that makes a reversal [encoder steps]
SAMPLES_PER_UNKNOWN = 2  # with fewer, a fit says nothing about whether the motion is a nod's
ROOT_12 = math.sqrt(12.0)  # a step over the standard deviation of its rounding
SPREAD = 1.2  # of the residuals over that of rounding, which chance does not exceed by more
STRAYS = 10  # one in so many samples may have a stamp that is off: the host was busy
LEAVE_OUT = 4  # one in so many of the samples beyond the scan at the end of a bad fit, at a time


class LegModelError(NodlidarError):
    """Joint samples that the leg model does not explain."""


TOO_FEW = 'too few joint samples for their reversals'
OTHER_MOTION = 'the motion is not legs of constant speed'


def leg_pitch(
    start_ns: int,
    offset: Array,
    sample_ns: NDArray[np.int64],
    sample_pitch: Array,
    joint_step: float,
) -> Array:
    """Return the pitch of each beam [rad], shape (n,), never NaN.

    It differs from the interpolation of the samples by no more than a reversal between two of
    them explains: half of the largest step from sample to sample, and two encoder steps.

    Parameters
    ----------
    start_ns
        Instant of the first beam [ns].
    offset
        Time of each beam after the first [s], ascending, shape (n,).
    sample_ns, sample_pitch
        Joint samples [ns], [rad], ascending, shape (m,), from some time before the first beam to
        some time after the last: the longer, the better, and half a leg is enough.
    joint_step
        The joint's encoder step [rad]. A sample may lie that far from the fitted motion: half of
        it is rounding, the other half what the fit and the stamps err. All together may spread by
        SPREAD times what rounding does.

    Raises
    ------
    LegModelError
        If samples are too few or lie farther from any such motion than rounding explains.
    """
    if np.max(np.abs(sample_pitch), initial=0.0) > math.tau:  # no nod, and what might overflow
        raise LegModelError(OTHER_MOTION)
    time = (sample_ns - start_ns) / NS_PER_S
    unknowns = _fit_where_it_holds(time, sample_pitch, offset, joint_step)
    pitch, _ = _motion(unknowns, offset)
    between = np.interp(offset, time, sample_pitch)
    beyond = np.max(np.abs(np.diff(sample_pitch))) / 2.0 + 2.0 * joint_step
    if not np.max(np.abs(pitch - between)) <= beyond:  # also if it is NaN
        raise LegModelError(OTHER_MOTION)
    return pitch


def _fit_where_it_holds(time: Array, pitch: Array, offset: Array, joint_step: float) -> Array:
    """Return the fit to as many of the samples around the scan as are of such a motion.

    At the ends, a turn may just begin, or a servo may have changed its speed. In between, single
    samples may be astray, if those next to them are not.
    """
    first, last = 0, len(time)
    kept, strays = np.ones(len(time), dtype=bool), len(time) // STRAYS
    before = int(np.searchsorted(time, offset[0], side='right')) - 1
    after = int(np.searchsorted(time, offset[-1])) + 1
    while first <= before and last >= after:
        used = first + np.flatnonzero(kept[first:last])
        unknowns, residual = _fit(time[used], pitch[used], joint_step)
        if _is_rounding(residual, len(unknowns), joint_step):
            return unknowns
        worst = int(used[np.argmax(residual)])
        if strays > 0 and first < worst < last - 1 and kept[worst - 1 : worst + 2].all():
            kept[worst] = False
            strays -= 1
        elif worst - first < last - worst:
            first += max((before - first) // LEAVE_OUT, 1)
        else:
            last -= max((last - after) // LEAVE_OUT, 1)
    raise LegModelError(OTHER_MOTION)


def _is_rounding(residual: Array, unknowns: int, joint_step: float) -> bool:
    spread = math.sqrt(np.sum(residual**2) / (len(residual) - unknowns))
    return bool(np.max(residual) <= joint_step and spread <= SPREAD * joint_step / ROOT_12)


def _fit(time: Array, pitch: Array, joint_step: float) -> tuple[Array, Array]:
    """Return the unknowns (see _motion) and how far each sample is from the motion [rad]."""
    turns = time[_extremes(pitch, TURN_DEPTH * joint_step)]
    unknowns = 3 + 2 * len(turns)
    if len(time) < SAMPLES_PER_UNKNOWN * unknowns:
        raise LegModelError(TOO_FEW)
    x = _corners(time, pitch, turns)
    rounding = joint_step / ROOT_12
    prior = np.zeros((1, unknowns))
    prior[0, 2] = 1.0 / ACCELERATION_SPREAD
    for _ in range(ITERATIONS):
        there, slopes = _motion(x, time)
        rows = np.vstack([slopes / rounding, prior, DAMPING * np.eye(unknowns)])
        toward = np.concatenate([(pitch - there) / rounding, -prior @ x, np.zeros(unknowns)])
        step = np.linalg.lstsq(rows, toward, rcond=None)[0]
        x = x + step
        x[2] = np.clip(x[2], -ACCELERATION_RANGE, ACCELERATION_RANGE)
        if np.max(np.abs(slopes @ step)) < SETTLED * joint_step:
            break
    return x, np.abs(pitch - _motion(x, time)[0])


def _corners(time: Array, pitch: Array, turns: Array) -> Array:
    """Return the unknowns of the best straight lines that meet at the given instants."""
    ramps = np.maximum(time[:, None] - turns, 0.0)
    lines = np.column_stack([np.ones_like(time), time, ramps])
    p, v, *changes = np.linalg.lstsq(lines, pitch, rcond=None)[0]
    return np.array([p, v, 0.0, *changes, *turns])


def _motion(x: Array, time: Array) -> tuple[Array, Array]:
    """Return the pitch at each time and its derivative by each unknown, shape (n, 3 + 2 k).

    The unknowns are p, v, ln(A / ACCELERATION), c_1 .. c_k, t_1 .. t_k.
    """
    turns = (len(x) - 3) // 2
    changes, instants = x[3 : 3 + turns], x[3 + turns :]
    half = np.maximum(np.abs(changes) / (2.0 * ACCELERATION * np.exp(x[2])), 1e-9)
    after = time[:, None] - instants
    share = (np.clip(after, -half, half) + half) / (2.0 * half)  # of the change that is done
    way = np.where(after > half, after, share**2 * half)
    widening = (share - share**2) * half  # half times the derivative of the way by half
    pitch = x[0] + x[1] * time + way @ changes
    by_acceleration = -widening @ changes
    slopes = [np.ones_like(time), time, by_acceleration, way + widening, -share * changes]
    return pitch, np.column_stack(slopes)


def _extremes(pitch: Array, depth: float) -> list[int]:
    """Return which samples are extremes, the way to each and back from it at least `depth`."""
    found: list[int] = []
    direction, extreme, start = 0, 0, 0
    for k, value in enumerate(pitch):
        if direction == 0:
            if abs(value - pitch[start]) >= depth:
                direction, extreme = (1 if value > pitch[start] else -1), k
        elif (value - pitch[extreme]) * direction > 0.0:
            extreme = k
        elif (pitch[extreme] - value) * direction >= depth:
            found.append(extreme)
            direction, extreme = -direction, k
    return found

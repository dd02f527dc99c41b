"""The pitch of every beam from a model of the nod, fitted to the joint samples around the scan.

The nod is legs of constant speed, joined at the reversals by parabolas of one acceleration A:

    pitch(t) = p + v t + sum_k c_k s(t - t_k; h_k),   h_k = |c_k| / (2 A),
    s(u; h) = 0 before -h,  (u + h)^2 / (4 h) up to h,  u after it.

Reversal k changes the speed by c_k about its instant t_k. p, v, c, t and A are fitted by least
squares, so that the encoder's rounding averages out over the samples of a leg, and a reversal is
located although hardly two samples fall in it. The model does not use the limits: each leg has its
own speed and its own ends.
"""

import math

from nodlidar_common.errors import NodlidarError
from nodlidar_common.nod import NS_PER_S
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Initial value and prior, of an unloaded RX-24F [rad/s2]; the samples of a reversal outweigh it.
ACCELERATION = 200.0
ACCELERATION_SPREAD = math.log(4.0)  # standard deviation of its logarithm
ACCELERATION_RANGE = math.log(100.0)  # largest change of its logarithm during the fit
ITERATIONS = 8  # of Gauss-Newton, which needs three or four if the motion is a nod
SETTLED = 2e-3  # change of the fitted samples at which the fit has converged [encoder steps]
DAMPING = 1e-3  # keeps unknowns that the samples do not determine from drifting
REVERSAL_DEPTH = 4.0  # return from an extreme that counts as a reversal [encoder steps]
SAMPLES_PER_UNKNOWN = 2  # with fewer, a fit cannot show whether the motion is a nod
ROOT_12 = math.sqrt(12.0)  # encoder step over the standard deviation of its rounding
SPREAD = 1.2  # largest ratio of the residuals' spread to that of rounding; allows for chance
STRAYS = 10  # one in so many samples may have a wrong stamp, as from a busy host
TRIM = 4  # of the samples beyond the scan at the worse end, a bad fit drops one in so many


class LegModelError(NodlidarError):
    """The leg model does not explain the joint samples."""


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

    It differs from the interpolated samples by at most half of the largest step from sample to
    sample, which a reversal between two samples can cause, plus two encoder steps.

    Parameters
    ----------
    start_ns
        Instant of the first beam [ns].
    offset
        Time of each beam after the first [s], ascending, shape (n,).
    sample_ns, sample_pitch
        Joint samples [ns], [rad], ascending, shape (m,), from before the first beam until after
        the last. More are better; half a leg on either side is enough.
    joint_step
        Encoder step of the joint [rad]. A sample may be that far off the fitted motion: half for
        rounding, half for errors of the fit and the stamps. The standard deviation of all may be
        SPREAD times that of rounding.

    Raises
    ------
    LegModelError
        If samples are too few, or farther off any such motion than rounding explains.
    """
    if np.max(np.abs(sample_pitch), initial=0.0) > math.tau:  # not a nod, and might overflow
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
    """Return the unknowns fitted to as many samples around the scan as the model explains.

    Samples at the ends are dropped if they do not fit: a reversal may just begin there, or the
    servo may have changed its speed. In between, only single samples with kept neighbours are.
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
            first += max((before - first) // TRIM, 1)
        else:
            last -= max((last - after) // TRIM, 1)
    raise LegModelError(OTHER_MOTION)


def _is_rounding(residual: Array, unknowns: int, joint_step: float) -> bool:
    spread = math.sqrt(np.sum(residual**2) / (len(residual) - unknowns))
    return bool(np.max(residual) <= joint_step and spread <= SPREAD * joint_step / ROOT_12)


def _fit(time: Array, pitch: Array, joint_step: float) -> tuple[Array, Array]:
    """Return the unknowns (see _motion) and the distance of each sample to the motion [rad]."""
    reversals = time[_extremes(pitch, REVERSAL_DEPTH * joint_step)]
    unknowns = 3 + 2 * len(reversals)
    if len(time) < SAMPLES_PER_UNKNOWN * unknowns:
        raise LegModelError(TOO_FEW)
    x = _corners(time, pitch, reversals)
    rounding = joint_step / ROOT_12
    prior = np.zeros((1, unknowns))
    prior[0, 2] = 1.0 / ACCELERATION_SPREAD
    for _ in range(ITERATIONS):
        fitted, slopes = _motion(x, time)
        rows = np.vstack([slopes / rounding, prior, DAMPING * np.eye(unknowns)])
        target = np.concatenate([(pitch - fitted) / rounding, -prior @ x, np.zeros(unknowns)])
        step = np.linalg.lstsq(rows, target, rcond=None)[0]
        x = x + step
        x[2] = np.clip(x[2], -ACCELERATION_RANGE, ACCELERATION_RANGE)
        if np.max(np.abs(slopes @ step)) < SETTLED * joint_step:
            break
    return x, np.abs(pitch - _motion(x, time)[0])


def _corners(time: Array, pitch: Array, reversals: Array) -> Array:
    """Return the unknowns of the straight lines, joined at the reversals [s], that fit best."""
    ramps = np.maximum(time[:, None] - reversals, 0.0)
    lines = np.column_stack([np.ones_like(time), time, ramps])
    p, v, *changes = np.linalg.lstsq(lines, pitch, rcond=None)[0]
    return np.array([p, v, 0.0, *changes, *reversals])


def _motion(x: Array, time: Array) -> tuple[Array, Array]:
    """Return the pitch at each time and its derivative by each unknown, shape (n, 3 + 2 k).

    The unknowns are p, v, ln(A / ACCELERATION), c_1 .. c_k, t_1 .. t_k.
    """
    reversals = (len(x) - 3) // 2
    changes, instants = x[3 : 3 + reversals], x[3 + reversals :]
    half = np.maximum(np.abs(changes) / (2.0 * ACCELERATION * np.exp(x[2])), 1e-9)
    after = time[:, None] - instants
    share = (np.clip(after, -half, half) + half) / (2.0 * half)  # of the speed change so far
    ramp = np.where(after > half, after, share**2 * half)  # s(u; h)
    widening = (share - share**2) * half  # h ds/dh
    pitch = x[0] + x[1] * time + ramp @ changes
    by_acceleration = -widening @ changes
    slopes = [np.ones_like(time), time, by_acceleration, ramp + widening, -share * changes]
    return pitch, np.column_stack(slopes)


def _extremes(pitch: Array, depth: float) -> list[int]:
    """Return the indices of extremes that the pitch approaches and leaves by at least `depth`."""
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

"""The pitch of every beam, estimated from joint samples.

The nod turns about one fixed axis. SLERP between two rotations about the same axis is the rotation
by the linearly interpolated angle (Shoemake 1985: ``q(u) = q0 (q0^-1 q1)^u``, and a power of a
rotation scales its angle), so interpolating the angle is SLERP exactly, without trigonometry.
"""

from nodlidar_common.errors import NodlidarError
from nodlidar_common.nod import NS_PER_S
import numpy as np
from numpy.typing import NDArray

# Largest position of a joint sample [rad]; beyond it, or not finite, it is ignored.
LARGEST = 1e6
# Height of a reversal that missing samples may cut off [rad].
MOST_CUT = 0.015
# A gap so many times the usual one means that samples are missing.
_MISSING = 1.5
# A larger change of speed [rad/s] is a jump, not a reversal.
_LARGEST_SPEED_CHANGE = 100.0


class PitchError(NodlidarError):
    """The joint samples do not determine the pitch of a scan's beams."""


def ordered_samples(
    time_ns: NDArray[np.int64], pitch: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the samples up to LARGEST in ascending time; of equal stamps, the last one.

    Parameters
    ----------
    time_ns, pitch
        Stamps [ns] and pitch [rad], both of shape (n,).
    """
    is_valid = np.abs(pitch) <= LARGEST
    if not is_valid.all():
        time_ns, pitch = time_ns[is_valid], pitch[is_valid]
    if (time_ns[1:] > time_ns[:-1]).all():
        return time_ns, pitch
    order = np.argsort(time_ns, kind='stable')
    time_ns, pitch = time_ns[order], pitch[order]
    last_of_equals = np.append(np.diff(time_ns) > 0, True)
    return time_ns[last_of_equals], pitch[last_of_equals]


def beam_pitch(
    estimator: str,
    start_ns: int,
    offset: NDArray[np.float64],
    sample_ns: NDArray[np.int64],
    sample_pitch: NDArray[np.float64],
    max_gap: float,
) -> NDArray[np.float64]:
    """Return the pitch of each beam [rad], shape (n,).

    Parameters
    ----------
    estimator
        ``nearest``: the sample nearest to the first beam, for the whole scan. ``ends``: linear
        from the first to the last beam (as laser_geometry does). ``slerp``: interpolated per beam
        between neighbouring samples.
    start_ns
        Instant of the first beam [ns].
    offset
        Time of each beam after the first [s], ascending, shape (n,).
    sample_ns, sample_pitch
        Joint samples [ns], [rad], ascending, shape (m,). Except for ``nearest``, they must
        bracket the beams.
    max_gap
        Longest time between neighbouring samples to interpolate over [s].

    Raises
    ------
    PitchError
        If there are no samples, they do not bracket the beams, or are too far apart.
    """
    if not len(sample_ns):
        raise PitchError('no joint samples')
    sample_time = (sample_ns - start_ns) / NS_PER_S
    if estimator == 'nearest':
        return _nearest(offset, sample_time, sample_pitch, max_gap)
    _require_bracket(offset, sample_time, max_gap)
    if estimator == 'slerp':
        return np.interp(offset, sample_time, sample_pitch)
    ends = np.interp(offset[[0, -1]], sample_time, sample_pitch)
    return np.interp(offset, offset[[0, -1]], ends)


def require_reversals_sampled(
    offset: NDArray[np.float64],
    sample_time: NDArray[np.float64],
    sample_pitch: NDArray[np.float64],
    usual_gap: float,
) -> None:
    """Raise PitchError if samples are missing at a reversal during the scan.

    Interpolation over a gap is right where the speed is constant, but cuts off the tip of a
    reversal. If the slopes before and after a gap differ from its own by a and b to the same side,
    two straight legs meet in it, ``a b / (a + b)`` times its duration above the chord.

    Parameters
    ----------
    offset
        Time of each beam [s], ascending, shape (n,).
    sample_time, sample_pitch
        Joint samples [s], [rad], ascending, shape (m,), which bracket the beams.
    usual_gap
        Time between joint samples if none is missing [s].
    """
    gap = np.diff(sample_time)
    is_used = (sample_time[1:] > offset[0]) & (sample_time[:-1] < offset[-1])
    is_wide = is_used & (gap > _MISSING * usual_gap)
    if not is_wide.any():
        return
    if len(gap) < 2:
        raise PitchError('joint samples missing at a reversal')
    bend = np.diff(np.diff(sample_pitch) / gap)
    bend[np.abs(bend) > _LARGEST_SPEED_CHANGE] = 0.0
    before, after = np.append(bend[:1], bend), np.append(bend, bend[-1:])
    both = np.maximum(np.abs(before + after), 1e-300)
    height = np.maximum(before * after, 0.0) / both * gap
    if np.any(is_wide & (height > MOST_CUT)):
        raise PitchError('joint samples missing at a reversal')


def _nearest(
    offset: NDArray[np.float64],
    sample_time: NDArray[np.float64],
    sample_pitch: NDArray[np.float64],
    max_gap: float,
) -> NDArray[np.float64]:
    nearest = int(np.argmin(np.abs(sample_time)))
    if abs(sample_time[nearest]) > max_gap:
        raise PitchError(f'no joint sample within {max_gap} s')
    return np.full(len(offset), sample_pitch[nearest])


def _require_bracket(
    offset: NDArray[np.float64], sample_time: NDArray[np.float64], max_gap: float
) -> None:
    if sample_time[0] > 0.0:
        raise PitchError('no joint sample before the first beam')
    if sample_time[-1] < offset[-1]:
        raise PitchError('no joint sample after the last beam')
    first, last = sample_time.searchsorted((0.0, offset[-1]), side='left')
    used = sample_time[max(first - 1, 0) : last + 1]
    if len(used) > 1 and (used[1:] - used[:-1]).max() > max_gap:
        raise PitchError(f'joint samples more than {max_gap} s apart')

"""The pitch of every beam, estimated from joint samples.

The nod turns about one fixed axis. SLERP between two rotations about the same axis is the rotation
by the linearly interpolated angle (Shoemake 1985: ``q(u) = q0 (q0^-1 q1)^u``, and a power of a
rotation scales its angle), so interpolating the angle is SLERP exactly, without trigonometry.
"""

from nodlidar_common.arrays import Array, Integers, Times
from nodlidar_common.errors import NodlidarError, ScanError
from nodlidar_common.stamps import NS_PER_S
import numpy as np

# Largest position of a joint sample [rad]; beyond it, or not finite, it is ignored.
LARGEST = 1e6
# Nothing nods faster [rad/s]; but stamps of samples may be too close to each other for a tick of
# the encoder [rad].
MOST_SPEED = 100.0
_LEAST_LEAP = 0.05


class PitchError(ScanError):
    """The joint samples do not determine the pitch of a scan's beams."""


class SplineError(NodlidarError):
    """The joint samples do not determine a spline."""


def ordered_samples(time_ns: Times, pitch: Array) -> tuple[Integers, Array]:
    """Return the samples up to LARGEST in ascending time; of equal stamps, the first one.

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
    time_ns, first = np.unique(time_ns, return_index=True)
    return time_ns, pitch[first]


def beam_pitch(
    estimator: str,
    start_ns: int,
    offset: Array,
    sample_ns: Times,
    sample_pitch: Array,
    max_gap: float,
) -> Array:
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


def _nearest(
    offset: Array,
    sample_time: Array,
    sample_pitch: Array,
    max_gap: float,
) -> Array:
    nearest = int(np.argmin(np.abs(sample_time)))
    if abs(sample_time[nearest]) > max_gap:
        raise PitchError(f'no joint sample within {max_gap} s')
    return np.full(len(offset), sample_pitch[nearest])


def _require_bracket(offset: Array, sample_time: Array, max_gap: float) -> None:
    if sample_time[0] > 0.0:
        raise PitchError('no joint sample before the first beam')
    if sample_time[-1] < offset[-1] - 1.0 / NS_PER_S:  # stamps are rounded
        raise PitchError('no joint sample after the last beam')
    first = sample_time.searchsorted(0.0, side='right') - 1
    used = sample_time[first : sample_time.searchsorted(offset[-1], side='left') + 1]
    if len(used) > 1 and (used[1:] - used[:-1]).max() > max_gap:
        raise PitchError(f'joint samples more than {max_gap} s apart')


def require_no_jump(sample_ns: Times, sample_pitch: Array) -> None:
    """Raise PitchError if the joint leaps from sample to sample, as where a count wraps.

    Parameters
    ----------
    sample_ns, sample_pitch
        Joint samples [ns], [rad], ascending, shape (m,).
    """
    step = np.abs(sample_pitch[1:] - sample_pitch[:-1])
    most = MOST_SPEED / NS_PER_S * (sample_ns[1:] - sample_ns[:-1])
    if (step > np.maximum(most, _LEAST_LEAP)).any():
        raise PitchError(f'joint jumps: it moves faster than {MOST_SPEED:g} rad/s')

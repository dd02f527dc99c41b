"""The last joint samples, which show where others are missing at a reversal."""

from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
import numpy as np

# Height of a reversal that missing samples may cut off [rad].
MOST_CUT = 0.015
_KEPT = 100  # samples
_SHORTER = 20  # one gap in this many is shorter than the usual one
# A gap this many times the usual one means that samples are missing.
_MISSING = 1.5
# A larger change of speed [rad/s] is a jump, not a reversal.
_LARGEST_SPEED_CHANGE = 100.0
_FEW = 10  # samples, over which late stamps hardly change the mean speed


class RecentSamples:
    """Keeps joint samples, and finds gaps that may hide a reversal.

    Interpolation over a gap is right where the speed is constant, but cuts off the tip of a
    reversal, where two straight legs meet: if their speeds differ from that across the gap by a
    and b to the same side, ``a b / (a + b)`` times its duration above the chord. The legs are as
    fast as the gaps beside show, but not faster than the nod has been lately.

    Missing samples make gaps longer, never shorter, so the usual gap is among the shortest of the
    last hundred, even if most samples are missing. It follows a lower rate within 95 samples.
    Stamps that jitter make gaps longer too, so a gap counts as far as the pitch bears it out.
    """

    def __init__(self) -> None:
        self._forget()

    def _forget(self) -> None:
        self._time_ns, self._pitch = np.empty(0, np.int64), np.empty(0)
        # Whether the sample before was the one kept before, which it need not be between scans.
        self._is_next = np.empty(0, np.bool_)

    def add(self, time_ns: Times, pitch: Array) -> None:
        """Add samples [ns], [rad], ascending, shape (n,), which may repeat earlier ones.

        If they begin between or before earlier ones, time went back, and those are forgotten.
        """
        first, kept_ns = 0, self._time_ns
        if len(kept_ns) and len(time_ns) and time_ns[0] <= kept_ns[-1]:
            if kept_ns[kept_ns.searchsorted(time_ns[0])] == time_ns[0]:
                first = int(time_ns.searchsorted(kept_ns[-1], side='right'))
            else:
                self._forget()
        is_next = np.arange(first, len(time_ns)) > 0
        self._time_ns = np.concatenate((self._time_ns, time_ns[first:]))[-_KEPT:]
        self._pitch = np.concatenate((self._pitch, pitch[first:]))[-_KEPT:]
        self._is_next = np.concatenate((self._is_next, is_next))[-_KEPT:]

    def may_hide_reversal(self, begin_ns: int, end_ns: int, time_ns: Times, pitch: Array) -> bool:
        """Return whether samples are missing at a reversal between two instants.

        Parameters
        ----------
        begin_ns, end_ns
            The instants [ns].
        time_ns, pitch
            The samples around them [ns], [rad], ascending, shape (m,), which were added.
        """
        kept_ns = (self._time_ns[1:] - self._time_ns[:-1])[self._is_next[1:]]
        gap_ns = time_ns[1:] - time_ns[:-1]
        if not len(gap_ns) or not len(kept_ns):
            return False
        usual_ns = np.partition(kept_ns, len(kept_ns) // _SHORTER)[len(kept_ns) // _SHORTER]
        if not (gap_ns > _MISSING * usual_ns).any():
            return False
        share, mean_ns = self._borne_out(), kept_ns.mean()
        usual_ns, gap_ns = (mean_ns + share * (each - mean_ns) for each in (usual_ns, gap_ns))
        is_wide = gap_ns > _MISSING * usual_ns
        is_wide &= (time_ns[1:] > begin_ns) & (time_ns[:-1] < end_ns)
        speed = max(_speed(self._time_ns, self._pitch), _speed(time_ns, pitch))
        cut = np.minimum(_cut_beside(gap_ns, pitch), _cut_at(speed, gap_ns, pitch))
        return bool(np.any(is_wide & (cut > MOST_CUT)))

    def _borne_out(self) -> float:
        """Return how far the steps of the pitch bear out the gaps in time, from 0 to 1.

        Where the nod is even, steps are proportional to the gaps if stamps are right, and alike if
        stamps jitter about a regular rate. So this is the slope of step against gap, each without
        the mean of three: the share of what a gap has beyond the mean that is true. A step that
        bears out its gap is added, so stamps are right as long as nothing shows the contrary.
        """
        time_ns, pitch, is_next = self._time_ns, self._pitch, self._is_next
        in_a_row = is_next[1:-2] & is_next[2:-1] & is_next[3:]
        step, way = np.diff(pitch), pitch[3:] - pitch[:-3]
        gap_share = (time_ns[2:-1] - time_ns[1:-2]) / (time_ns[3:] - time_ns[:-3])
        by_time = (way * (gap_share - 1.0 / 3.0))[in_a_row]
        by_pitch = (step[1:-1] - way / 3.0)[in_a_row]
        one = float(np.mean(step**2)) + 1e-12
        slope = (float(by_time @ by_pitch) + one) / (float(by_time @ by_time) + one)
        return min(max(slope, 0.0), 1.0)


def _speed(time_ns: Times, pitch: Array) -> float:
    """Return how fast the nod has been over a few samples, at most [rad/s]."""
    way = np.append(0.0, np.abs(np.diff(pitch)).cumsum())
    few = min(_FEW, len(way) - 1)
    return float(((way[few:] - way[:-few]) / (time_ns[few:] - time_ns[:-few])).max()) * NS_PER_S


def _cut_beside(gap_ns: Times, pitch: Array) -> Array:
    """Return the height of a reversal in each gap, by the speeds beside it [rad], shape (n,)."""
    gap = gap_ns / NS_PER_S
    if len(gap) < 2:
        return np.full(len(gap), np.inf)
    bend = np.diff(np.diff(pitch) / gap)
    bend[np.abs(bend) > _LARGEST_SPEED_CHANGE] = 0.0
    before, after = np.append(bend[:1], bend), np.append(bend, bend[-1:])
    both = np.maximum(np.abs(before + after), 1e-300)
    return np.asarray(np.maximum(before * after, 0.0) / both * gap)


def _cut_at(speed: float, gap_ns: Times, pitch: Array) -> Array:
    """Return the height of a reversal in each gap, of legs with a speed [rad/s], shape (n,)."""
    gap = gap_ns / NS_PER_S
    across = np.minimum(np.abs(np.diff(pitch)) / gap, speed)
    return np.asarray((speed**2 - across**2) / max(2.0 * speed, 1e-300) * gap)

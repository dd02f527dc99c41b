"""Joint samples in ascending time, without those whose stamps are wrong."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.reversals import TIME_JUMP_NS
from nodlidar_common.parameters import parameter

Sample = tuple[int, float]
# So many consecutive samples of another time show that time itself jumped.
LEAST_TO_JUMP = 3


@dataclass(frozen=True)
class JointSamplesConfig:
    """Joint samples."""

    max_joint_gap: float = parameter(
        0.1,
        'Longest time between joint samples to interpolate over',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )


class JointOrder:
    """Passes on samples that follow each other, and rejects single ones of another time.

    A sample older than the one before it, or later by more than the longest leap, is held back.
    When LEAST_TO_JUMP in a row are of that other time, time has jumped, and they are passed on.

    Parameters
    ----------
    longest_leap_ns
        Longest time from one sample to the next [ns]; at least a second.

    Attributes
    ----------
    rejected
        Number of samples whose time did not fit their neighbours.
    """

    def __init__(self, longest_leap_ns: int = 0) -> None:
        self.rejected = 0
        self._leap_ns = max(longest_leap_ns, TIME_JUMP_NS)
        self._newest_ns: int | None = None
        self._others: list[Sample] = []

    def restart(self) -> None:
        """Restart: the next sample may be of any time."""
        self._reject_others()
        self._newest_ns = None

    def add(self, time_ns: int, pitch: float) -> list[Sample]:
        """Add a sample [ns], [rad]; return the samples that are confirmed by it.

        If the first of these is older than the last one returned before, time went back.
        """
        sample = time_ns, pitch
        if self._newest_ns is None or self._follows(self._newest_ns, time_ns):
            self._reject_others()
            confirmed = [sample]
        else:
            if self._others and not self._follows(self._others[-1][0], time_ns):
                self._reject_others()
            self._others.append(sample)
            if len(self._others) < LEAST_TO_JUMP:
                return []
            confirmed, self._others = self._others, []
        self._newest_ns = confirmed[-1][0]
        return confirmed

    def _follows(self, before_ns: int, time_ns: int) -> bool:
        return before_ns <= time_ns <= before_ns + self._leap_ns

    def _reject_others(self) -> None:
        self.rejected += len(self._others)
        self._others.clear()

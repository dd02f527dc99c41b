"""Joint samples in the order of their time, whatever single stamps say."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.turns import TIME_JUMP_NS
from nodlidar_common.parameters import parameter

Sample = tuple[int, float]
# As many samples in a row are needed until another time is believed.
TO_BELIEVE = 3


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
    """Passes on samples that follow each other; a single one of another time is left out.

    A sample that is older than the one before it, or later by more than the longest leap, waits
    for those after it: when three in a row are of another time, that one counts from there on.

    Parameters
    ----------
    longest_leap_ns
        Longest time from a sample to the next [ns]; a second at least.

    Attributes
    ----------
    left_out
        How many were of another time than those around them.
    """

    def __init__(self, longest_leap_ns: int = 0) -> None:
        self.left_out = 0
        self._leap_ns = max(longest_leap_ns, TIME_JUMP_NS)
        self._newest_ns: int | None = None
        self._others: list[Sample] = []

    def restart(self) -> None:
        """Begin anew with whatever comes next."""
        self._leave_out()
        self._newest_ns = None

    def add(self, time_ns: int, pitch: float) -> list[Sample]:
        """Add a sample [ns], [rad]; return those that are sure by now.

        When the first of these is older than the last one that was returned, time went back.
        """
        sample = time_ns, pitch
        if self._newest_ns is None or self._follows(self._newest_ns, time_ns):
            self._leave_out()
            sure = [sample]
        else:
            if self._others and not self._follows(self._others[-1][0], time_ns):
                self._leave_out()
            self._others.append(sample)
            if len(self._others) < TO_BELIEVE:
                return []
            sure, self._others = self._others, []
        self._newest_ns = sure[-1][0]
        return sure

    def _follows(self, before_ns: int, time_ns: int) -> bool:
        return before_ns <= time_ns <= before_ns + self._leap_ns

    def _leave_out(self) -> None:
        self.left_out += len(self._others)
        self._others.clear()

"""Samples that are kept back until it is sure that they may be believed."""

from collections.abc import Callable

from nodlidar_servo.sample import Sample


class HeldSamples:
    """Keeps samples back while they are in doubt, and lets them go if that is soon over.

    Parameters
    ----------
    longest_ns
        For how long a doubt may last [ns]; after that all that was kept back is wrong.
    on_withheld
        Called with how many are never let go.
    """

    def __init__(self, longest_ns: int, on_withheld: Callable[[int], None]) -> None:
        self._longest_ns, self._on_withheld = longest_ns, on_withheld
        self._held: list[Sample] = []
        self._is_over = False

    def add(self, sample: Sample, is_believed: bool) -> list[Sample]:
        """Take the next sample; return those that are believed now, in the order of their time."""
        self._held.append(sample)
        if is_believed:
            self._is_over = False
        elif self._is_over or sample.stamp_ns - self._held[0].stamp_ns > self._longest_ns:
            self._is_over = True
            self._on_withheld(len(self._held))
        else:
            return []
        held, self._held = self._held, []
        return held if is_believed else []

"""Holds samples back while they are in doubt."""

from collections.abc import Callable

from nodlidar_servo.device.sample import Sample


class HeldSamples:
    """Holds samples back while they are in doubt, and releases them if the doubt ends soon.

    Parameters
    ----------
    longest_ns
        Longest doubt [ns]; after it, all samples that are held back are withheld for good.
    on_withheld
        Called with the number of samples that are withheld.
    """

    def __init__(self, longest_ns: int, on_withheld: Callable[[int], None]) -> None:
        self._longest_ns, self._on_withheld = longest_ns, on_withheld
        self._held: list[Sample] = []
        self._is_over = False

    def add(self, sample: Sample, is_believed: bool) -> list[Sample]:
        """Add the next sample; return those that are now believed, in the order of their times."""
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

"""Samples that follow each other in time, without those whose stamps are wrong."""

from collections.abc import Callable
from typing import Generic, TypeVar

Sample = TypeVar('Sample')
# A sample older than the last one by this much means that the clock was set.
TIME_JUMP_NS = 1_000_000_000
# So many consecutive samples of another time show that time itself jumped.
LEAST_TO_JUMP = 3
UNSTAMPED = 'transform without a stamp on /tf'
TRANSFORM_OUT_OF_ORDER = 'transform whose stamp does not fit its neighbours'


class TimeOrder(Generic[Sample]):
    """Passes on samples that follow each other, and rejects single ones of another time.

    A sample that is older than the newest one by more than the longest fall, or later by more than
    the longest leap, is held back. When LEAST_TO_JUMP in a row are of that other time, time has
    jumped, and they are passed on.

    Parameters
    ----------
    on_reject
        Called for each sample whose time did not fit its neighbours.
    longest_leap_ns
        Longest time from one sample to the next [ns]; at least a second.
    longest_fall_ns
        By how much a sample may be older than the newest one [ns].

    Attributes
    ----------
    newest_ns
        Time of the newest sample that was passed on [ns]; None if there is none.
    """

    def __init__(
        self,
        on_reject: Callable[[], None],
        longest_leap_ns: int = 0,
        longest_fall_ns: int = 0,
    ) -> None:
        self._on_reject = on_reject
        self._leap_ns = max(longest_leap_ns, TIME_JUMP_NS)
        self._fall_ns = longest_fall_ns
        self._newest: tuple[int, int] | None = None  # time and clock [ns], as of `add`
        self._others: list[tuple[int, int, Sample]] = []

    @property
    def newest_ns(self) -> int | None:
        """Time of the newest sample that was passed on [ns]; None if there is none."""
        return None if self._newest is None else self._newest[0]

    def restart(self) -> None:
        """Restart: the next sample may be of any time."""
        self._reject_others()
        self._newest = None

    def withdraw(self) -> list[Sample]:
        """Return the samples that are held back, and forget them."""
        held = [other for *_, other in self._others]
        self._others.clear()
        return held

    def add(self, time_ns: int, sample: Sample, clock_ns: int = 0) -> list[Sample]:
        """Add a sample of a time [ns]; return the samples that are confirmed by it.

        If the first of these is older than the newest one before, by more than the longest fall,
        time went back.

        Parameters
        ----------
        time_ns, sample
            A sample and its time [ns].
        clock_ns
            A clock [ns] at its arrival. After a silence, a sample may also be later by as much as
            this clock advanced. 0 for samples that never pause.
        """
        now = time_ns, clock_ns
        if self._newest is None or self._follows(self._newest, now):
            self._reject_others()
            self._newest = max(self._newest or now, now)
            return [sample]
        if self._others and not self._follows(self._others[-1][:2], now):
            self._reject_others()
        self._others.append((*now, sample))
        if len(self._others) < LEAST_TO_JUMP:
            return []
        self._newest = now
        return self.withdraw()

    def _follows(self, before: tuple[int, int], now: tuple[int, int]) -> bool:
        later_ns, silence_ns = (b - a for a, b in zip(before, now, strict=True))
        return -self._fall_ns <= later_ns <= self._leap_ns + max(silence_ns, 0)

    def _reject_others(self) -> None:
        for _ in self._others:
            self._on_reject()
        self._others.clear()

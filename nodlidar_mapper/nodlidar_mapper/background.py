"""Work that takes longer than a callback may."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any


class Background:
    """Runs one job at a time in a thread of its own.

    Start it and take its results from one thread, which publishes them.
    """

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._job: tuple[Future[Any], Callable[[Any], None]] | None = None

    @property
    def busy(self) -> bool:
        """Whether there is a job whose result was not delivered yet."""
        return self._job is not None

    def start(self, job: Callable[[], Any], then: Callable[[Any], None]) -> None:
        """Start a job; `deliver` calls `then` with its result."""
        assert not self.busy
        self._job = self._thread.submit(job), then

    def deliver(self) -> None:
        """Deliver the result of a job that has ended; raise what the job raised."""
        if self._job is None or not self._job[0].done():
            return
        (job, then), self._job = self._job, None
        then(job.result())

    def finish(self) -> None:
        """Wait for the end of the last job, and deliver its result."""
        self._thread.shutdown()
        self.deliver()

    def end(self) -> None:
        """Wait for the end of the last job, and forget it."""
        self._thread.shutdown()
        self._job = None

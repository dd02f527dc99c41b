"""A progress bar for long work."""

from collections.abc import Iterable, Iterator
from operator import length_hint
import time
from typing import TypeVar

from nodlidar_common.terminal import progress_bar

T = TypeVar('T')

BAR_AFTER = 0.5  # s, before a progress bar appears


def progress(items: Iterable[T]) -> Iterator[T]:
    """Yield items, with a progress bar on stderr once that takes longer than BAR_AFTER."""
    bar = progress_bar()
    work = bar.add_task('evaluating nods', total=length_hint(items) or None)
    began, shown = time.monotonic(), False
    try:
        for item in items:
            yield item
            bar.advance(work)
            if not shown and time.monotonic() - began > BAR_AFTER:
                bar.start()
                shown = True
    finally:
        if shown:
            bar.stop()

"""Checks of the options that both demos have: their folder and their duration."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
import shutil

from nodlidar_common.errors import ParameterError

MARK = '.nodlidar_demo'
"""File in the bag of a demo."""

LONGEST = 3600.0
"""Of a demo [s]; a longer recording may not fit into memory."""


@contextmanager
def new_bag(output: Path) -> Iterator[Path]:
    """Yield where a demo writes its bag; that of an earlier demo is deleted.

    Raises
    ------
    ParameterError
        If there is a bag that no demo wrote.
    OSError
        If the folder cannot be written.
    """
    bag = output / 'bag'
    if bag.exists() and not (bag / MARK).exists():
        limit = f"that of an earlier demo, or without '{bag}': delete it if you do not need it"
        raise ParameterError('--output', limit, str(output))
    output.mkdir(parents=True, exist_ok=True)
    if bag.exists():
        shutil.rmtree(bag)
    try:
        yield bag
    finally:
        if bag.is_dir():
            with suppress(OSError):  # as of a full disk, which the demo has told
                (bag / MARK).touch()


def check_duration(seconds: float) -> None:
    """Raise ParameterError for a duration that a demo cannot have."""
    if not 0.0 < seconds <= LONGEST:
        raise ParameterError('--duration', f'above 0 and at most {LONGEST:g} s', seconds)

"""Checks of the options that both demos have: their folder and their duration."""

from pathlib import Path
import shutil

from nodlidar_common.errors import ParameterError

MARK = '.nodlidar_demo'
"""File of a folder whose bag is that of a demo."""

LONGEST = 3600.0
"""Of a demo [s]; a longer recording may not fit into memory."""


def bag_folder(output: Path) -> Path:
    """Return where a demo writes its bag, made ready: that of an earlier demo is deleted.

    Raises
    ------
    ParameterError
        If there is a bag that no demo wrote.
    OSError
        If the folder cannot be written.
    """
    bag, mark = output / 'bag', output / MARK
    if bag.exists() and not mark.exists():
        raise ParameterError('--output', "that of an earlier demo, or without 'bag'", str(output))
    output.mkdir(parents=True, exist_ok=True)
    mark.touch()
    if bag.exists():
        shutil.rmtree(bag)
    return bag


def check_duration(seconds: float) -> None:
    """Raise ParameterError for a duration that a demo cannot have."""
    if not 0.0 < seconds <= LONGEST:
        raise ParameterError('--duration', f'above 0 and at most {LONGEST:g} s', seconds)

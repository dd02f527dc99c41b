"""Files that are there as a whole or not at all, whatever happens while they are written."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a path to write to, of the same suffix, whose file takes its place in the end.

    After an error, or a kill, what was there before is still there.

    Raises
    ------
    OSError
        Naming the path, if the disk is full, or it cannot be written for another reason.
    """
    part = path.with_name(f'.{path.stem}.part{path.suffix}')
    with named(path):
        try:
            yield part
            part.replace(path)
        except BaseException:
            with suppress(OSError):
                part.unlink(missing_ok=True)
            raise


@contextmanager
def named(path: Path) -> Iterator[None]:
    """Give an OSError raised inside the name of the file or folder that is written."""
    try:
        yield
    except OSError as error:
        if error.strerror is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error

"""Files that appear complete or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path with the same suffix; its file replaces `path` at the end.

    After an error, or if the process is killed, `path` is unchanged.

    Raises
    ------
    OSError
        With the path, if it cannot be written.
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
    """Add the name of a file or folder to an OSError within the context."""
    try:
        yield
    except OSError as error:
        if error.strerror is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error

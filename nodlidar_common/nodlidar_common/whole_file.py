"""Files that appear complete or not at all, alone or together."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import errno
import os
from pathlib import Path
import shutil
from tempfile import TemporaryFile


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


def check_writable(path: Path) -> None:
    """Raise OSError, with the path, if a file cannot be written there: before long work."""
    with named(path):
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        with TemporaryFile(dir=path.parent):
            pass


@contextmanager
def whole_files(folder: Path) -> Iterator[Path]:
    """Yield an empty temporary folder, whose files replace those in `folder` together at the end.

    After an error the files in `folder`, which is created if it does not exist, are unchanged.

    Raises
    ------
    OSError
        With the folder, if a file in it cannot be written.
    """
    part = folder / '.part'
    with named(folder):
        try:
            shutil.rmtree(part, ignore_errors=True)  # of a process that was killed
            part.mkdir(parents=True)
            yield part
            for path in part.iterdir():
                path.replace(folder / path.name)
        finally:
            shutil.rmtree(part, ignore_errors=True)


@contextmanager
def named(path: Path) -> Iterator[None]:
    """Add the name of a file or folder to an OSError within the context."""
    try:
        yield
    except OSError as error:
        if error.strerror is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error

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

    After an error, or if the process is killed, `path` is unchanged. Of a link, the file that it
    leads to is replaced.

    Raises
    ------
    OSError
        With the path, if it cannot be written.
    """
    with named(path):
        file = _replaceable(path)
        part = file.with_name(f'.{file.stem}.part{file.suffix}')
        try:
            yield part
            part.replace(file)
        except BaseException:
            with suppress(OSError):
                part.unlink(missing_ok=True)
            raise


def check_writable(path: Path) -> None:
    """Raise OSError, with the path, if a file cannot be written there: before long work."""
    with named(path), TemporaryFile(dir=_replaceable(path).parent):
        pass


def _replaceable(path: Path) -> Path:
    """Return the file that a path leads to; raises OSError for a folder or a device."""
    file = Path(os.path.realpath(path))
    if file.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if file.exists() and not file.is_file():
        raise OSError(errno.EINVAL, 'it is no regular file')
    return file


@contextmanager
def whole_files(folder: Path) -> Iterator[Path]:
    """Yield an empty temporary folder, whose files replace those in `folder` together at the end.

    After an error the files in `folder`, which is created if it does not exist, are unchanged.

    Raises
    ------
    OSError
        With the folder, or the file in it that cannot be replaced.
    """
    part, existed = folder / '.part', folder.exists()
    try:
        with named(folder):
            shutil.rmtree(part, ignore_errors=True)  # of a process that was killed
            part.mkdir(parents=True)
            yield part
            new = {path: folder / path.name for path in part.iterdir()}
        for file in new.values():
            with named(file):
                _replaceable(file)
        with named(folder):
            for path, file in new.items():
                path.replace(file)
    finally:
        shutil.rmtree(part, ignore_errors=True)
        if not existed:
            with suppress(OSError):  # it holds the files
                folder.rmdir()


@contextmanager
def named(path: Path) -> Iterator[None]:
    """Add the name of a file or folder to an OSError within the context."""
    try:
        yield
    except OSError as error:
        if error.strerror is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error

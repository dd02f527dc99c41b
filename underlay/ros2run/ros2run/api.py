"""Finding and running the executables of packages."""

from __future__ import annotations

from contextlib import suppress
import os
from pathlib import Path
import signal
import subprocess

from ament_index_python.packages import get_package_prefix
from underlay_refusal import refuse

__all__ = ['MultipleExecutables', 'get_executable_path', 'run_executable']
__getattr__ = refuse(__name__, __all__)


class MultipleExecutables(Exception):  # noqa: N818
    """A package has several executables of that name."""

    def __init__(self, paths: list[str]) -> None:
        super().__init__(paths)
        self.paths = paths


def get_executable_path(*, package_name: str, executable_name: str) -> str | None:
    """Return the path of an executable anywhere in the lib directory of a package, or None.

    Raises
    ------
    ament_index_python.packages.PackageNotFoundError
        When there is no such package.
    MultipleExecutables
        When the package has several executables of that name.

    """
    directory = Path(get_package_prefix(package_name)) / 'lib' / package_name
    paths = [
        str(path)
        for path in sorted(directory.rglob('*'))
        if path.name == executable_name and path.is_file() and os.access(path, os.X_OK)
    ]
    if len(paths) > 1:
        raise MultipleExecutables(paths)
    return paths[0] if paths else None


def run_executable(*, path: str, argv: list[str], prefix: list[str] | None = None) -> int:
    """Run an executable, and return its exit status, negative for the signal that ended it.

    A terminal's Ctrl-C reaches the executable too, so it is waited for.
    """
    process = subprocess.Popen([*(prefix or []), path, *argv])
    while process.returncode is None:
        with suppress(KeyboardInterrupt):
            process.wait()
    if process.returncode < 0:
        print('[ros2run]:', signal.strsignal(-process.returncode))
    elif process.returncode > 0:
        print('[ros2run]:', f'Process exited with failure {process.returncode}')
    return process.returncode

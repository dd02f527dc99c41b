"""ros2 run."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace, REMAINDER
from contextlib import suppress
import os
from pathlib import Path
import signal
import subprocess

from ament_index_python.packages import get_package_prefix, PackageNotFoundError


class RunCommand:
    """Run a package specific executable."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Declare the command's arguments."""
        parser.add_argument('package_name', help='Name of the ROS package')
        parser.add_argument('executable_name', help='Name of the executable')
        parser.add_argument(
            'argv', nargs=REMAINDER, help='Pass arbitrary arguments to the executable'
        )

    def main(self, args: Namespace) -> int | str:
        """Run the executable; return its exit status or an error message."""
        paths = _find(args.package_name, args.executable_name)
        if not paths:
            return 'No executable found'
        if len(paths) > 1:
            return 'Multiple executables found:' + ''.join(f'\n- {path}' for path in paths)
        return _run([str(paths[0]), *args.argv])


def _find(package: str, executable: str) -> list[Path]:
    """Return the executables of that name anywhere in the lib directory of a package."""
    try:
        directory = Path(get_package_prefix(package), 'lib', package)
    except PackageNotFoundError as error:
        raise RuntimeError(f"Package '{package}' not found") from error
    return [
        path
        for path in sorted(directory.rglob('*'))
        if path.name == executable and path.is_file() and os.access(path, os.X_OK)
    ]


def _run(cmd: list[str]) -> int:
    """Run a command; return its exit status, negative for the signal that ended it.

    Ctrl-C in a terminal reaches the command too, so wait for its end.
    """
    process = subprocess.Popen(cmd)
    while process.returncode is None:
        with suppress(KeyboardInterrupt):
            process.wait()
    if process.returncode < 0:
        print('[ros2run]:', signal.strsignal(-process.returncode))
    elif process.returncode > 0:
        print('[ros2run]:', f'Process exited with failure {process.returncode}')
    return process.returncode

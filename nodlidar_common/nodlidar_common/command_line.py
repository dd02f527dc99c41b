"""Common parts of every command: option parser, exit status, errors as one line.

Exit statuses: 0 success; 1 failure; 2 invalid option, or invalid value in a parameter, scene or
route file; 130 interrupted by Ctrl-C. Errors go to stderr.
"""

import argparse
from collections.abc import Callable, Sequence
from importlib import import_module
import io
import os
import sys
import traceback
from typing import NoReturn

from nodlidar_common.errors import NodlidarError, ParameterError

DONE, COULD_NOT, NOT_ALLOWED, INTERRUPTED = 0, 1, 2, 130
# Name of an environment variable: if it is set, tracebacks are shown, too.
TRACEBACK = 'NODLIDAR_TRACEBACK'
_LONGEST = 1000  # characters of an error line
# Names of Python packages for pip, and for apt where Ubuntu 24.04 has them.
_PACKAGES = {
    'matplotlib': ('matplotlib', 'python3-matplotlib'),
    'plyfile': ('plyfile', None),
    'scipy': ('scipy', 'python3-scipy'),
    'numpy': ('numpy', 'python3-numpy'),
    'rich': ('rich', 'python3-rich'),
    'rosbags': ('rosbags', None),
    'serial': ('pyserial', 'python3-serial'),
    'viser': ('viser', None),
    'transforms3d': ('transforms3d', 'python3-transforms3d'),
    'xacro': ('xacro', 'ros-jazzy-xacro'),
    'yaml': ('pyyaml', 'python3-yaml'),
}


class _WithDefaults(argparse.HelpFormatter):
    """Adds the default of an option to its help, unless that states it."""

    def _get_help_string(self, action: argparse.Action) -> str:
        text = action.help or ''
        has_none = action.default in (None, '', argparse.SUPPRESS) or action.nargs == 0
        return text if has_none or 'default' in text else f'{text} [default: %(default)s]'


class LineParser(argparse.ArgumentParser):
    """A parser with errors of one line and without abbreviated options; help states defaults."""

    def __init__(self, prog: str, description: str | None) -> None:
        super().__init__(
            prog, description=description, allow_abbrev=False, formatter_class=_WithDefaults
        )

    def error(self, message: str) -> NoReturn:
        """Exit with status 2 and a line on stderr."""
        self.exit(NOT_ALLOWED, f'{_line(self.prog, message)}\n')


def run(prog: str, work: Callable[[], int | None]) -> int:
    """Run a command; return its exit status.

    Errors that a user, a file or a disk causes are one line on stderr, without a traceback.

    Parameters
    ----------
    prog
        The command's name.
    work
        The command; returns the exit status, or None for 0. It should import the packages that
        may be missing on a machine; see `command`.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # The terminal may lack characters, such as those of a file name.
            stream.reconfigure(errors='backslashreplace')
    try:
        status = _status_of(work)
        sys.stdout.flush()  # so that a full disk is noticed here
    except KeyboardInterrupt:
        print(f'{prog}: interrupted', file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader has closed the pipe: drop what is still buffered.
        _drop_output()
        return COULD_NOT
    except Exception as error:
        if os.environ.get(TRACEBACK):
            traceback.print_exc()
        if isinstance(error, OSError):
            _drop_output()
        print(_line(prog, in_words(error)), file=sys.stderr)
        return NOT_ALLOWED if isinstance(error, ParameterError) else COULD_NOT
    return status


def command(module: str) -> Callable[..., int]:
    """Return the entry point of a command, which takes its options and returns its exit status.

    Parameters
    ----------
    module
        The module with the command's name, whose `main` takes the options. It is imported by the
        entry point, so that a missing package is an error of one line.
    """

    def entry_point(argv: Sequence[str] | None = None) -> int:
        return run(module.rpartition('.')[2], lambda: import_module(module).main(argv))

    return entry_point


def in_words(error: Exception) -> str:
    """Return an error's message, and what to do if that is known."""
    if isinstance(error, ModuleNotFoundError) and error.name:
        return _missing(error.name.partition('.')[0])
    if isinstance(error, OSError) and error.strerror:
        return ': '.join([error.strerror, *(f"'{f}'" for f in _files_of(error))])
    if isinstance(error, MemoryError):
        return 'there is not enough memory'
    if isinstance(error, (NodlidarError, OSError)):
        return str(error)
    return f'internal error, {type(error).__name__}: {error} (set {TRACEBACK}=1 for a traceback)'


def _status_of(work: Callable[[], int | None]) -> int:
    try:
        return work() or DONE
    except SystemExit as exit_:  # argparse's
        return exit_.code if isinstance(exit_.code, int) else DONE


def _missing(package: str) -> str:
    if package in _PACKAGES:
        pip, apt = _PACKAGES[package]
        by_apt = f', or apt install {apt}' if apt else ''
        return f'needs the Python package {package}: pip install {pip}{by_apt}'
    return f'needs the package {package}: source the setup file of a ROS 2 that has it'


def _files_of(error: OSError) -> list[object]:
    return [file for file in (error.filename, error.filename2) if file is not None]


def _line(prog: str, message: str) -> str:
    text = ' '.join(message.split())
    return f'{prog}: error: ' + (text if len(text) <= _LONGEST else f'{text[:_LONGEST]} ...')


def _drop_output() -> None:
    """Drop what stdout has buffered if it cannot be written."""
    try:
        sys.stdout.flush()
    except OSError:
        with open(os.devnull, 'w') as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())

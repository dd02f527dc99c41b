"""The launch log on the screen and in a file.

The file is launch.log in a new directory below $ROS_LOG_DIR, or $ROS_HOME/log, or ~/.ros/log.
"""

from collections.abc import Container
from contextlib import suppress
from datetime import datetime
from functools import cache
import os
from pathlib import Path
import socket
import time
from typing import TextIO

_ALL = ('screen', 'log')
# Where a process's standard output and standard error go.
OUTPUTS = {'screen': (['screen'], ['screen']), 'log': (['log'], _ALL), 'both': (_ALL, _ALL)}


@cache
def log_directory() -> Path:
    """Make this run's log directory."""
    home = os.environ.get('ROS_HOME') or '~/.ros'
    base = Path(os.environ.get('ROS_LOG_DIR') or f'{home}/log').expanduser()
    now = datetime.now().strftime('%Y-%m-%d-%H-%M-%S-%f')
    path = base / f'{now}-{socket.gethostname()}-{os.getpid()}'
    path.mkdir(parents=True)
    return path


@cache
def _file() -> TextIO:
    return (log_directory() / 'launch.log').open('w', encoding='utf-8')


def write(line: str, destinations: Container[str] = _ALL) -> None:
    """Write a line; a screen or a disk that is gone does not hinder the launch."""
    if 'screen' in destinations:
        with suppress(OSError):
            print(line, flush=True)
    if 'log' in destinations:
        with suppress(OSError):
            print(f'{time.time():.7f} {line}', file=_file(), flush=True)


def log(severity: str, name: str, message: str) -> None:
    """Log a message of launch's own, under a name."""
    write(f'[{severity}] [{name}]: {message}')

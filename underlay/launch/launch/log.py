"""The launch log on the screen and in a file.

The file is launch.log in a new directory below $ROS_LOG_DIR, or $ROS_HOME/log, or ~/.ros/log.
"""

from contextlib import suppress
from datetime import datetime
from functools import cache
import os
from pathlib import Path
import socket
import time
from typing import TextIO


@cache
def log_directory() -> Path:
    """Create this run's log directory at the first call; return it."""
    home = os.environ.get('ROS_HOME') or '~/.ros'
    base = Path(os.environ.get('ROS_LOG_DIR') or f'{home}/log').expanduser()
    now = datetime.now().strftime('%Y-%m-%d-%H-%M-%S-%f')
    path = base / f'{now}-{socket.gethostname()}-{os.getpid()}'
    path.mkdir(parents=True)
    return path


@cache
def _file() -> TextIO:
    return (log_directory() / 'launch.log').open('w', encoding='utf-8')


def show(line: str) -> None:
    """Write a line to the screen; without a screen, the launch goes on."""
    with suppress(OSError):
        print(line, flush=True)


def log(severity: str, name: str, message: str) -> None:
    """Write a message of the launch itself to the screen and the file, under a name."""
    line = f'[{severity}] [{name}]: {message}'
    show(line)
    with suppress(OSError):
        print(f'{time.time():.7f} {line}', file=_file(), flush=True)

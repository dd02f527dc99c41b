"""The launch log on the screen and in a file.

The file is launch.log in a new directory below $ROS_LOG_DIR, or $ROS_HOME/log, or ~/.ros/log.
"""

from __future__ import annotations

from datetime import datetime
from functools import cache
import logging
import os
from pathlib import Path
import socket
import sys
from typing import TextIO

from underlay_refusal import refuse

__all__ = ['get_logger', 'get_output_loggers']
__getattr__ = refuse(__name__, __all__)

_SCREEN_FORMAT = '[{levelname}] [{name}]: {message}'
_FILE_FORMAT = '{created:.7f} [{levelname}] [{name}]: {message}'
# Where a process's standard output and standard error go.
_DESTINATIONS = {
    'screen': ({'screen'}, {'screen'}),
    'log': ({'log'}, {'log', 'screen'}),
    'both': ({'log', 'screen'}, {'log', 'screen'}),
}


class _ScreenHandler(logging.StreamHandler):
    """Writes to whatever sys.stdout is at the time."""

    def __init__(self) -> None:
        logging.Handler.__init__(self)

    @property
    def stream(self) -> TextIO:
        return sys.stdout


# A tree of its own, so that the loggers of other libraries stay as they are.
_tree = logging.Manager(logging.RootLogger(logging.INFO))


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
def _handler(destination: str, format_: str) -> logging.Handler:
    if destination == 'screen':
        handler: logging.Handler = _ScreenHandler()
    else:
        handler = logging.FileHandler(log_directory() / 'launch.log', encoding='utf-8')
    handler.setFormatter(logging.Formatter(format_, style='{'))
    return handler


def set_level(level: int) -> None:
    """Set the level below which launch's own messages are dropped."""
    _tree.root.setLevel(level)


def get_logger(name: str | None = None) -> logging.Logger:
    """Return a logger that writes to the screen and to the launch log file."""
    if not _tree.root.handlers:
        _tree.root.addHandler(_handler('screen', _SCREEN_FORMAT))
        _tree.root.addHandler(_handler('log', _FILE_FORMAT))
    return _tree.getLogger(name) if name else _tree.root


def get_output_loggers(
    process_name: str, output_config: str
) -> tuple[logging.Logger, logging.Logger]:
    """Return the loggers of a process's standard output and standard error.

    Parameters
    ----------
    process_name
        Name of the process.
    output_config
        'screen', 'log' (to the log file, standard error to the screen too) or 'both'.

    Raises
    ------
    NotImplementedError
        For another output configuration.

    """
    if output_config not in _DESTINATIONS:
        raise NotImplementedError(
            f'output={output_config!r} is not covered, only {", ".join(_DESTINATIONS)} are'
        )
    stdout, stderr = _DESTINATIONS[output_config]
    return (
        _output_logger(f'{process_name}-stdout', stdout),
        _output_logger(f'{process_name}-stderr', stderr),
    )


def _output_logger(name: str, destinations: set[str]) -> logging.Logger:
    logger = _tree.getLogger(name)
    logger.propagate = False
    formats = {'screen': '{message}', 'log': '{created:.7f} {message}'}
    logger.handlers = [_handler(x, formats[x]) for x in sorted(destinations)]
    return logger

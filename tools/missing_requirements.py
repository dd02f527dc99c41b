"""Writes what pip installs beside a sourced ROS: its own packages stay, missing ones are pinned.

The packages of a ROS and its system fit each other: messages are built for their NumPy,
launch_testing plugs into their pytest. Only the linters are always those of requirements.lock.

    python tools/missing_requirements.py REQUIREMENTS CONSTRAINTS
"""

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
import re
import sys

LINTERS = ('ruff', 'mypy', 'types-')


def main() -> None:
    """Write the requirements, and the constraints on their dependencies."""
    wanted = [line for line in _lines('requirements.in') if not line.startswith('ros-')]
    locked = [line for line in _lines('requirements.lock') if not line.startswith('ros-')]
    requirements = [
        f'{_name(line)}=={here}' if (here := _version_here(line)) else line for line in wanted
    ]
    Path(sys.argv[1]).write_text('\n'.join(dict.fromkeys(requirements)))
    Path(sys.argv[2]).write_text('\n'.join(line for line in locked if not _version_here(line)))


def _lines(file: str) -> list[str]:
    lines = (Path(__file__).parent.parent / file).read_text().splitlines()
    return [line for line in lines if line and not line.startswith('#')]


def _name(line: str) -> str:
    return re.split(r'[^A-Za-z0-9._-]', line)[0]


def _version_here(line: str) -> str | None:
    """Return the installed version of a requirement, None if another is needed."""
    name = _name(line)
    if name.startswith(LINTERS):
        return None
    try:
        return version(name)
    except PackageNotFoundError:
        return None


if __name__ == '__main__':
    main()

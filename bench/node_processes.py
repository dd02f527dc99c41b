"""The processes of a launched sensor's nodes."""

from contextlib import suppress
from pathlib import Path

import psutil

NODES = ('driver', 'servo', 'assembler', 'robot_state_publisher')


def node_processes(launch_pid: int) -> dict[str, psutil.Process]:
    """Return the process of each node that a launch has started and that still runs."""
    found: dict[str, psutil.Process] = {}
    with suppress(psutil.NoSuchProcess):
        for child in psutil.Process(launch_pid).children(recursive=True):
            with suppress(psutil.NoSuchProcess):
                for node in {Path(part).name for part in child.cmdline()[:2]} & set(NODES):
                    found[node] = child
    return found

"""The processes of a launched sensor's nodes, and the processor time that they use."""

from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import psutil

NODES = ('driver', 'servo', 'assembler', 'robot_state_publisher')


def node_processes(launch_pid: int, nodes: Iterable[str] = NODES) -> dict[str, psutil.Process]:
    """Return the process of each of some nodes that a launch has started and that still runs."""
    found: dict[str, psutil.Process] = {}
    with suppress(psutil.NoSuchProcess):
        for child in psutil.Process(launch_pid).children(recursive=True):
            with suppress(psutil.NoSuchProcess):
                for node in {Path(part).name for part in child.cmdline()[:2]} & set(nodes):
                    found[node] = child
    return found


def processor_seconds(launch_pid: int) -> Counter[str]:
    """Return the processor time that each node has used so far [s]."""
    used: Counter[str] = Counter()
    for node, process in node_processes(launch_pid).items():
        used[node] += seconds_of(process)  # type: ignore[assignment]
    return used


def seconds_of(process: psutil.Process) -> float:
    """Return the processor time that a process has used so far [s]."""
    times = process.cpu_times()
    return float(times.user + times.system)

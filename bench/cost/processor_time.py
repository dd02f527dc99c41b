"""The processor time of all nodes, by profile, against that of another version.

Build the other version in a folder of its own: `git worktree add FOLDER COMMIT`, `make -C FOLDER
build`. Then `python -m bench processor_time --against FOLDER`. The set-ups alternate, so that what
else runs on the machine burdens all of them; counted are processor times, not durations.
"""

from collections import Counter
import os
from pathlib import Path
from statistics import median
import subprocess
import tempfile
import time

from nodlidar_bringup.ros.launched import keep_apart, launched_sensor
import rclpy
from rclpy.wait_for_message import wait_for_message
from sensor_msgs.msg import PointCloud2

from bench.shared.node_processes import NODES, processor_seconds
from bench.shared.report import Row

ROUNDS, WARM_UP, DURATION = 4, 3.0, 12.0
START_TIMEOUT = 30.0
PUBLISHER = 'robot_state_publisher'
OTHER = 'balanced, the version before'
TITLE = f'Processor time of the nodes, in the room: median of {ROUNDS} runs of {DURATION:.0f} s'

# Workspace, None for this one, and profile, by name.
SetUps = dict[str, tuple[Path | None, str]]


def results(against: Path) -> list[Row]:
    """Return the shares of a core of each set-up, and their ratios to the first one."""
    setups: SetUps = {OTHER: (against, 'balanced')}
    setups |= {profile: (None, profile) for profile in ('balanced', 'fast')}
    runs: dict[str, list[Counter[str]]] = {name: [] for name in setups}
    for _ in range(ROUNDS):
        for name, (workspace, profile) in setups.items():
            runs[name].append(_shares(workspace, profile))
    return rows(runs)


def rows(runs: dict[str, list[Counter[str]]]) -> list[Row]:
    """Return a row per set-up of its runs: medians of shares of a core, ratios to the first."""
    totals = {name: median([run.total() for run in own]) for name, own in runs.items()}
    without = {
        name: median([run.total() - run[PUBLISHER] for run in own]) for name, own in runs.items()
    }
    first = next(iter(runs))
    return [
        {
            'set-up': name,
            **{f'{node} [%]': median([run[node] * 100.0 for run in own]) for node in NODES},
            'all nodes [%]': totals[name] * 100.0,
            'ratio': totals[name] / totals[first],
            f'without {PUBLISHER} [%]': without[name] * 100.0,
            'ratio without it': without[name] / without[first],
        }
        for name, own in runs.items()
    ]


def _shares(workspace: Path | None, profile: str) -> Counter[str]:
    """Return the share of a core that each node takes [1]."""
    keep_apart()
    with tempfile.TemporaryDirectory() as name:
        arguments = ('ideal:=true', f'profile:={profile}')
        environment = None if workspace is None else _environment(workspace)
        log = Path(name) / 'launch.log'
        with launched_sensor(log, *arguments, environment=environment) as sensor:
            _wait_for_cloud()
            time.sleep(WARM_UP)
            before, began = processor_seconds(sensor.process.pid), time.monotonic()
            time.sleep(DURATION)
            used, took = processor_seconds(sensor.process.pid), time.monotonic() - began
            _wait_for_cloud()
    assert used.keys() == set(NODES), f'only {sorted(used)} ran'
    return Counter({node: (used[node] - before[node]) / took for node in NODES})


def _wait_for_cloud() -> None:
    """Wait until a cloud is published: nodes at rest would use less time."""
    rclpy.init()
    node = rclpy.create_node('waiting')
    came, _ = wait_for_message(PointCloud2, node, 'points', time_to_wait=START_TIMEOUT)
    node.destroy_node()
    rclpy.shutdown()
    assert came, f'no cloud within {START_TIMEOUT} s'


def _environment(workspace: Path) -> dict[str, str]:
    """Return the environment of a shell that has sourced a workspace."""
    command = ['bash', '-c', 'source "$0"/env.sh && env -0', str(workspace)]
    shell = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ)
    return dict(line.split('=', 1) for line in shell.stdout.split('\0') if line)

"""The launched system, simulated devices included: latency of the clouds and load of the nodes.

A node that receives the assembler's messages and ignores them runs beside it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import subprocess
import sys
import tempfile

from nodlidar_bringup.ros.launched import keep_apart, launched_sensor
from nodlidar_demo.delivery import read_delivery
from nodlidar_demo.ros.demonstration import record
import numpy as np
import psutil
from rich.console import Console
import yaml

from bench.shared.node_processes import NODES, processor_seconds, seconds_of
from bench.shared.reference import FEEDBACK_RATE
from bench.shared.report import Row

DURATION = 20.0
TITLE = f'The launched sensor in the room, {DURATION:.0f} s'
SETUPS = {
    **{f'profile {name}': [f'profile:={name}'] for name in FEEDBACK_RATE},
    'estimator trajectory': ['assembler_params:={folder}/assembler.yaml'],
    # The rate of an adapter with a latency timer of 16 ms.
    'joint states at 62 Hz': ['servo_params:={folder}/servo.yaml'],
}
PARAMETERS: dict[str, Row] = {
    'servo': {'feedback_rate': 62.0},
    'assembler': {'estimator': 'trajectory'},
}


def results() -> list[Row]:
    """Return latency and load of each set-up."""
    return [{'set-up': name, **measure(arguments)} for name, arguments in SETUPS.items()]


def measure(arguments: list[str]) -> Row:
    """Return latencies from last byte to publication, and the nodes' shares of a core."""
    keep_apart()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for node, values in PARAMETERS.items():
            file = {'/**': {'ros__parameters': values}}
            (folder / f'{node}.yaml').write_text(yaml.safe_dump(file))
        given = [argument.format(folder=folder) for argument in arguments]
        with (
            launched_sensor(folder / 'launch.log', 'ideal:=true', *given) as sensor,
            _receiver() as receiver,
        ):
            record(folder / 'warm_up', 2.0, sensor, Console(quiet=True))
            before, received_before = processor_seconds(sensor.process.pid), seconds_of(receiver)
            record(folder / 'bag', DURATION, sensor, Console(quiet=True))
            used = processor_seconds(sensor.process.pid) - before
            receiving = seconds_of(receiver) - received_before
        latency = read_delivery(folder / 'bag').latency
    median, high = np.percentile(latency, [50, 99]) * 1e3
    return {
        'latency p50 [ms]': float(median),
        'latency p99 [ms]': float(high),
        **{f'CPU of {node} [%]': used[node] / DURATION * 100.0 for node in NODES},
        'CPU of all nodes [%]': used.total() / DURATION * 100.0,
        'CPU of a node that only receives [%]': receiving / DURATION * 100.0,
    }


@contextmanager
def _receiver() -> Iterator[psutil.Process]:
    with subprocess.Popen([sys.executable, '-m', 'bench.cost.receiver']) as child:
        try:
            yield psutil.Process(child.pid)
        finally:
            child.terminate()

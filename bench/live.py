"""The launched system, simulated devices included: latency of the clouds and load of the nodes."""

from pathlib import Path
import tempfile

from nodlidar_bringup.delivery import read_delivery
from nodlidar_bringup.demo import record
from nodlidar_bringup.launched import keep_apart, launched_sensor
import numpy as np
import psutil
from rich.console import Console
import yaml

from bench.report import Row

DURATION = 20.0
RATES = (62.0, 100.0)
TITLE = f'The launched sensor in the room, {DURATION:.0f} s'
NODES = ('driver', 'servo', 'assembler', 'robot_state_publisher')


def results() -> list[Row]:
    """Return latency and load by the rate of the joint states."""
    rows = []
    for rate in RATES:
        latency, load = measure(rate)
        median, high = np.percentile(latency, [50, 99]) * 1e3
        rows.append(
            {
                'joint states [Hz]': rate,
                'latency p50 [ms]': median,
                'latency p99 [ms]': high,
                'CPU of the nodes [% of a core]': load * 100.0,
            }
        )
    return rows


def measure(feedback_rate: float) -> tuple[np.ndarray, float]:
    """Return latencies from last byte to publication [s], and the nodes' share of a core."""
    keep_apart()
    with tempfile.TemporaryDirectory() as folder:
        parameters = Path(folder) / 'servo.yaml'
        values = {'/**': {'ros__parameters': {'feedback_rate': feedback_rate}}}
        parameters.write_text(yaml.safe_dump(values))
        bag = Path(folder) / 'bag'
        log = Path(folder) / 'launch.log'
        with launched_sensor(log, f'servo_params:={parameters}') as sensor:
            record(Path(folder) / 'warm_up', 2.0, sensor, Console(quiet=True))
            before = _cpu_seconds(sensor.process.pid)
            record(bag, DURATION, sensor, Console(quiet=True))
            load = (_cpu_seconds(sensor.process.pid) - before) / DURATION
        return read_delivery(bag).latency, load


def _cpu_seconds(launch_pid: int) -> float:
    """Return the processor time that the nodes have used so far [s]."""
    children = psutil.Process(launch_pid).children(recursive=True)
    times = [child.cpu_times() for child in children if _is_node(child)]
    return sum(time.user + time.system for time in times)


def _is_node(process: psutil.Process) -> bool:
    return any(Path(part).name in NODES for part in process.cmdline()[:2])

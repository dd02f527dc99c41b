"""Each emulated servo and lidar in the whole launch: its clouds, their latency, the phase.

With the errors of the scene's devices, and without them. An ideal servo has the bytes and the
encoder of its model only.
"""

from pathlib import Path
import tempfile

from nodlidar_assembler.bags.bag_source import messages_of
from nodlidar_assembler.bags.read_bag import read_bag
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_bringup.ros.launched import keep_apart, launched_sensor
from nodlidar_demo.delivery import read_delivery
from nodlidar_demo.evaluation import near_beams, points_of, surface_rms
from nodlidar_demo.ros.demonstration import record, VEIL_ANGLE
from nodlidar_sim.devices.scip_models import SCIP_MODELS
from nodlidar_sim.devices.servo_models import EMULATED
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.servo_motion import ServoMotion
from nodlidar_sim.world.world import World
import numpy as np
from rich.console import Console

from bench.shared.report import Row

SCENE, DURATION, SETTLING = 'room', 12.0, 4.0  # s
SETUPS = {
    **{f'{name}, URG-04LX-UG01': f'servo:={name}' for name in EMULATED},
    **{f'RX-24F, {name}': f'lidar:={name}' for name in SCIP_MODELS if name != 'URG-04LX-UG01'},
}
TITLE = f"Servos and lidars in the whole launch, scene '{SCENE}', {DURATION:.0f} s"


def results() -> list[Row]:
    """Return a row for each servo and each lidar."""
    return [_row(name, argument) for name, argument in SETUPS.items()]


def _row(name: str, argument: str) -> Row:
    real, ideal = (_measured(argument, is_ideal) for is_ideal in (False, True))
    return {
        'servo, lidar': name,
        'points RMS [mm]': real['rms'],
        'points RMS, ideal [mm]': ideal['rms'],
        'latency p50 [ms]': real['p50'],
        'latency p99 [ms]': real['p99'],
        'phase error RMS [ms]': real['phase'],
        'scans per second': real['rate'],
    }


def _measured(argument: str, is_ideal: bool) -> dict[str, float]:
    keep_apart()
    with tempfile.TemporaryDirectory() as name:
        folder, arguments = Path(name), [argument, f'ideal:={str(is_ideal).lower()}']
        with launched_sensor(folder / 'launch.log', *arguments) as sensor:
            quiet = Console(quiet=True)
            record(folder / 'settling', SETTLING, sensor, quiet)
            record(folder / 'bag', DURATION, sensor, quiet)
        bag = folder / 'bag'
        log = read_bag(bag, AssemblerConfig())
        phase, latency = phase_errors(bag), read_delivery(bag).latency
    world = World(load_scene(SCENE, ideal=is_ideal), ServoMotion(), start_ns=log.scans[0].stamp_ns)
    points = points_of(near_beams(log), 'slerp', VEIL_ANGLE)
    elapsed = (log.scans[-1].stamp_ns - log.scans[0].stamp_ns) / 1e9
    return {
        'rms': surface_rms(points, world) * 1e3,
        'p50': float(np.median(latency)) * 1e3,
        'p99': float(np.quantile(latency, 0.99)) * 1e3,
        'phase': float(np.sqrt(np.nanmean(np.square(phase)))),
        'rate': (len(log.scans) - 1) / elapsed,
    }


def phase_errors(bag: Path) -> list[float]:
    """Return the phase errors [ms] in the diagnostics of a bag; NaN while the nod changes."""
    return [
        float(item.value)
        for recorded in messages_of(bag, lambda topic, kind: topic.endswith('diagnostics'))
        for status in recorded.message.status
        for item in status.values
        if item.key == 'phase error [ms]'
    ]

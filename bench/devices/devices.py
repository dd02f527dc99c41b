"""Each emulated servo and lidar in the whole launch: its clouds, their latency, the phase.

With the errors of the scene's devices, and without them. An ideal servo has the bytes and the
encoder of its model only. Lidars with third-party drivers are simulated with these: the latency is
then from the publication of their scans.
"""

from pathlib import Path
import tempfile

from nodlidar_assembler.bags.bag_source import messages_of
from nodlidar_assembler.bags.read_bag import read_bag
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_bringup.ros.launch_arguments import BEST_EFFORT
from nodlidar_bringup.ros.launched import keep_apart, launched_sensor
from nodlidar_bringup.ros.shared_files import share
from nodlidar_common.ldrobot import LD19
from nodlidar_common.parameter_file import file_values
from nodlidar_demo.delivery import read_delivery
from nodlidar_demo.evaluation import near_beams, points_of_log, surface_rms
from nodlidar_demo.ros.demonstration import MIXED_PIXEL_ANGLE, record
from nodlidar_sim.devices.make_devices import LIDARS, SERVOS
from nodlidar_sim.devices.other_lidars import OTHER_LIDARS
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.world import World
import numpy as np
from rich.console import Console

from bench.shared.report import Row

SCENE, DURATION, SETTLING = 'room', 12.0, 4.0  # s
LONGER = {'ldlidar': 100.0}  # s, in which the delay of its stamps goes through 0 to 0.1 s
SERVO, LIDAR = 'RX-24F', 'URG-04LX-UG01'
SETUPS = [
    *((servo, LIDAR) for servo in SERVOS),
    *((SERVO, lidar) for lidar in LIDARS if lidar != LIDAR),
    ('XL430-W250', LD19),  # the set that docs/hardware.md recommends
]
TITLE = f"Servos and lidars in the whole launch, scene '{SCENE}', {DURATION:.0f} s"


def results() -> list[Row]:
    """Return a row for each servo and each lidar."""
    return [_row(servo, lidar) for servo, lidar in SETUPS]


def _row(servo: str, lidar: str) -> Row:
    real, ideal = (_measured(servo, lidar, is_ideal) for is_ideal in (False, True))
    return {
        'servo, lidar': f'{servo}, {lidar}',
        'points RMS [mm]': real['rms'],
        'points RMS, ideal [mm]': ideal['rms'],
        'latency p50 [ms]': real['p50'],
        'latency p99 [ms]': real['p99'],
        'phase error RMS [ms]': real['phase'],
        'scans per second': real['rate'],
    }


def _measured(servo: str, lidar: str, is_ideal: bool) -> dict[str, float]:
    keep_apart()
    arguments = f'servo:={servo}', f'lidar:={lidar}', f'ideal:={str(is_ideal).lower()}'
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with launched_sensor(folder / 'launch.log', *arguments) as sensor:
            how = sensor, Console(quiet=True), lidar in BEST_EFFORT
            record(folder / 'settling', SETTLING, *how)
            record(folder / 'bag', LONGER.get(lidar, DURATION), *how)
        bag, others = folder / 'bag', conventions(lidar) if lidar in OTHER_LIDARS else None
        log = read_bag(bag, others or AssemblerConfig())
        phase, latency = phase_errors(bag), read_delivery(bag, others).latency
    world = World(load_scene(SCENE, ideal=is_ideal), IdealServo(), start_ns=log.scans[0].stamp_ns)
    points = points_of_log(near_beams(log), 'slerp', MIXED_PIXEL_ANGLE)
    elapsed = (log.scans[-1].stamp_ns - log.scans[0].stamp_ns) / 1e9
    return {
        'rms': surface_rms(points, world) * 1e3,
        'p50': float(np.median(latency)) * 1e3,
        'p99': float(np.quantile(latency, 0.99)) * 1e3,
        'phase': float(np.sqrt(np.nanmean(np.square(phase)))),
        'rate': (len(log.scans) - 1) / elapsed,
    }


def conventions(lidar: str) -> AssemblerConfig:
    """Return what the assembler is told about the driver of a lidar."""
    file = share('nodlidar_bringup', f'config/lidars/{lidar}.yaml')
    return AssemblerConfig(**file_values([file], 'assembler', AssemblerConfig))


def phase_errors(bag: Path) -> list[float]:
    """Return the phase errors [ms] in the diagnostics of a bag; NaN while the nod changes."""
    return [
        float(item.value)
        for recorded in messages_of(bag, lambda topic, kind: topic.endswith('diagnostics'))
        for status in recorded.message.status
        for item in status.values
        if item.key == 'phase error [ms]'
    ]

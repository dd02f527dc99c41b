"""The demo: launch a simulated sensor, record it, measure its clouds and draw them."""

import argparse
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
import time

from nodlidar_assembler.bags.read_bag import read_bag, with_odometry
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.bags.write_clouds import open_output
from nodlidar_assembler.clouds.mixed_pixels import MixedPixelConfig
from nodlidar_assembler.clouds.pitch_estimator import ESTIMATORS
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_bringup.ros.launched import keep_apart, launched_sensor, LaunchedSensor
from nodlidar_common.errors import NodlidarError
from nodlidar_common.terminal import progress_bar
from nodlidar_common.whole_file import named
from nodlidar_demo.delivery import read_delivery, read_start_ns
from nodlidar_demo.evaluation import (
    lidar_rms,
    moved_surface_rms,
    near_beams,
    points_of_log,
    surface_rms,
)
from nodlidar_demo.options import new_bag
from nodlidar_demo.pictures import write_picture
from nodlidar_demo.report import Distances, print_report
from nodlidar_demo.ros.recorder import Recorder
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.scene import load_scene, Scene
from nodlidar_sim.world.world import World
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

START_TIMEOUT = 60.0
MIXED_PIXEL_ANGLE = MixedPixelConfig().mixed_pixel_angle  # of the filter of mixed pixels


class DemoError(NodlidarError):
    """The sensor did not start, or ended too early."""


def demonstrate(options: argparse.Namespace) -> None:
    """Run the demo with the options of its command.

    Raises
    ------
    DemoError
        If the sensor does not start, or ends too early.
    ParameterError
        For a scene, a route or a folder that is not allowed.
    OSError
        If the results cannot be written.
    """
    console = Console()
    scene = load_scene(options.scene, options.route, ideal=options.ideal)
    output = options.output
    keep_apart()
    arguments = launch_arguments(options.scene, options.route, scene)
    if options.ideal:
        arguments.append('ideal:=true')
    with (
        new_bag(output) as bag,
        launched_sensor(output / 'launch.log', *arguments) as sensor,
    ):
        record(bag, options.duration, sensor, console, adapts=True)
    with console.status('Measuring'):
        log, distances = _measured(bag, scene)
        _draw(log, scene, output, f"'{scene.name}', {options.duration:g} s")
    print_report(log, read_delivery(bag), distances, console)
    console.print(f'{output}/: cloud.ply, cloud.png, bag, launch.log')


def _measured(bag: Path, scene: Scene) -> tuple[SensorLog, Distances]:
    """Return what was recorded in a scene, and the distances of its points to the surfaces."""
    config = AssemblerConfig()
    log = read_bag(bag, config)
    near = near_beams(log)
    start_ns = read_start_ns(bag) if scene.moves else log.scans[0].stamp_ns
    world = World(scene, IdealServo(), start_ns=start_ns)
    lidar = 0.0 if scene.lidar.ideal else lidar_rms(near, scene, start_ns, MIXED_PIXEL_ANGLE)
    rms, filtered = (
        {e: surface_rms(points_of_log(near, e, angle), world) for e in ESTIMATORS}
        for angle in (0.0, MIXED_PIXEL_ANGLE)
    )
    rms_by_odometry = {}
    if scene.drives:
        log = with_odometry(log, bag, config)
        rms_by_odometry = {e: _moved_rms(near_beams(log), e, world) for e in ESTIMATORS}
    return log, Distances(rms, filtered, rms_by_odometry, lidar)


def _moved_rms(log: SensorLog, estimator: str, world: World) -> float:
    points = points_of_log(log, estimator)
    return moved_surface_rms(points.xyz, points.time_ns, world)


def _draw(log: SensorLog, scene: Scene, output: Path, title: str) -> None:
    """Write a log's points without mixed pixels, and draw them as seen from the sensor's start."""
    points = points_of_log(log, 'slerp', MIXED_PIXEL_ANGLE)
    with open_output(output / 'cloud.ply', AssemblerConfig()) as file:
        file.write(points, 'odom' if scene.drives else 'nodlidar_base_link', points.time_ns[-1])
    xyz = scene.mount.to_child(points.xyz) if scene.drives else points.xyz
    write_picture(xyz, output / 'cloud.png', title)


def launch_arguments(scene_name: str, route: str | None, scene: Scene) -> list[str]:
    """Return the launch arguments for a scene, loaded by that name and route.

    If anything moves, the simulation publishes its start; if the base drives, also odometry, and
    clouds are in odom.
    """
    arguments = [f'scene:={scene_name}']
    if route is not None:
        arguments.append(f'route:={route}')
    if scene.moves:
        arguments.append('base:=odometry')
    if scene.drives:
        arguments.append('ego_motion:=beam')
    return arguments


def record(
    bag: Path,
    duration: float,
    sensor: LaunchedSensor,
    console: Console,
    best_effort: bool = False,
    adapts: bool = False,
) -> None:
    """Record a sensor into a bag, for a time [s] from the first cloud on.

    Parameters
    ----------
    bag, duration
        Where, and for how long [s].
    sensor, console
        What is recorded, and where the progress is shown.
    best_effort
        Whether the scans are published best effort.
    adapts
        Whether limits and speed of the nod follow the range in the second half. The first half is
        with the whole nod, which shows floor and ceiling.

    Raises
    ------
    DemoError
        If no cloud is received, or the sensor ends too early.
    OSError
        If the bag cannot be written.
    """
    with named(bag), ExitStack() as stack:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        stack.callback(rclpy.try_shutdown)
        recorder = Recorder(bag, best_effort)
        stack.callback(recorder.destroy_node)
        stack.callback(recorder.close)
        executor = SingleThreadedExecutor()
        executor.add_node(recorder)
        with _progress(console) as progress:
            task = progress.add_task('waiting for the first cloud', total=duration)
            for done in _seconds_of_clouds(recorder, executor, sensor, duration):
                progress.update(task, completed=done, description=_counts(recorder))
                if adapts and done >= duration / 2.0:
                    adapts = False
                    recorder.adapt_limits()


def _progress(console: Console) -> Progress:
    columns = TextColumn('{task.description}'), BarColumn(), TimeRemainingColumn()
    return progress_bar(*columns, console=console, stays=True)


def _counts(recorder: Recorder) -> str:
    counts = recorder.counts
    return f'{counts["scan"]} scans, {counts["joint_states"]} poses, {counts["points"]} clouds'


def _seconds_of_clouds(
    recorder: Recorder,
    executor: SingleThreadedExecutor,
    sensor: LaunchedSensor,
    duration: float,
) -> Iterator[float]:
    """Spin until all topics have been recorded for a duration; yield the seconds so far."""
    started = time.monotonic()
    began: float | None = None
    while began is None or time.monotonic() - began < duration:
        executor.spin_once(timeout_sec=0.1)
        if not sensor.running():
            raise DemoError(f'the sensor ended too early: see {sensor.log}')
        if began is None:
            if time.monotonic() - started > START_TIMEOUT:
                raise DemoError(f'no cloud within {START_TIMEOUT:g} s: see {sensor.log}')
            began = time.monotonic() if recorder.complete() else None
        else:
            yield time.monotonic() - began

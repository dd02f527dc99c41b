"""Distance of a recorded sensor's points to the true surfaces."""

from dataclasses import dataclass, replace
import math

from nodlidar_assembler.bags.sensor_log import assemble_log, SensorLog
from nodlidar_assembler.clouds.mixed_pixels import find_mixed_pixels, MixedPixelConfig
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig
from nodlidar_assembler.clouds.points import place, Points
from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import NodlidarError
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.lidar import Lidar
from nodlidar_sim.world.scene import Scene
from nodlidar_sim.world.world import World
import numpy as np

FAR = 3.0
"""Longest range [m] of the beams that count: the error by a wrong pitch grows with the range."""


class EvaluationError(NodlidarError):
    """A log without points."""


def points_of_log(log: SensorLog, estimator: str, mixed_pixel_angle: float = 0.0) -> Points:
    """Return all points of a log; raises EvaluationError if there are none."""
    config = PipelineConfig(estimator=estimator, mixed_pixel_angle=mixed_pixel_angle)
    clouds, drops = assemble_log(log, config)
    if not clouds:
        raise EvaluationError(f'the log gives no points; scans dropped: {dict(drops)}')
    origin = clouds[0].origin
    times = np.concatenate([cloud.time_ns for cloud in clouds])
    data = np.concatenate([cloud.data_from(origin) for cloud in clouds])
    return Points(times, data, origin)


def near_beams(log: SensorLog) -> SensorLog:
    """Return a log without the beams that are longer than FAR."""
    scans = [replace(scan, geometry=replace(scan.geometry, range_max=FAR)) for scan in log.scans]
    return replace(log, scans=scans)


def surface_rms(points: Points, world: World) -> float:
    """Return the RMS distance of points in nodlidar_base_link to the true surfaces [m]."""
    distance = world.surface_distance(points.xyz, points.time_ns)
    return float(np.sqrt(np.mean(distance**2)))


@dataclass(frozen=True, slots=True)
class RecordedMotion:
    """The motion of a log's joint, linear between its samples."""

    log: SensorLog

    def position(self, times_ns: Times) -> Array:
        """Return the pitch [rad] at times [ns]."""
        return np.interp(times_ns, self.log.sample_ns, self.log.sample_pitch)

    def velocity(self, times_ns: Times) -> Array:
        """Return the angular velocity [rad/s] at times [ns]."""
        rates = np.diff(self.log.sample_pitch) / np.diff(self.log.sample_ns) * NS_PER_S
        after = np.searchsorted(self.log.sample_ns[1:-1], times_ns, side='right')
        return np.asarray(rates[after])


def lidar_rms(
    log: SensorLog, scene: Scene, start_ns: int, mixed_pixel_angle: float = 0.0
) -> float:
    """Return the RMS distance [m] to the true surfaces that the errors of the lidar alone cause.

    The scans of a log are measured anew, with the log's motion for the true one, and placed by it.

    Parameters
    ----------
    log
        Its scans give the instants of the beams, and range_max.
    scene, start_ns
        The scene, and when its objects and its base leave their start [ns].
    mixed_pixel_angle
        Of the filter of mixed pixels; 0 for none.
    """
    motion = RecordedMotion(log)
    world = World(scene, motion, start_ns=start_ns)
    lidar, pipeline = Lidar(scene.lidar, world, start_ns, 0), Pipeline(PipelineConfig())
    config = MixedPixelConfig(mixed_pixel_angle=mixed_pixel_angle)
    squares, count = 0.0, 0
    for scan in log.scans:
        beams = pipeline.beams(scan.geometry)
        times_ns = scan.stamp_ns + beams.offset_ns
        ranges = lidar.ranges(times_ns, beams.azimuth).astype(np.float32)
        if mixed_pixel_angle:
            ranges[find_mixed_pixels(ranges, scan.geometry, config)] = np.nan
        placed = place(beams, ranges, motion.position(times_ns))
        distance = world.surface_distance(placed.xyz.T, times_ns[placed.indices])
        squares, count = squares + float(distance @ distance), count + len(distance)
    return math.sqrt(squares / max(count, 1))


def moved_surface_rms(xyz: Array, times_ns: Times, world: World) -> float:
    """Return the RMS distance of points (n, 3) in the frame of odometry to the true surfaces [m].

    That frame is base_link where the base starts.
    """
    x, y, yaw = world.scene.base_start
    in_world = Pose.from_xyzrpy((x, y, 0.0, 0.0, 0.0, yaw)).to_parent(xyz)
    distance = world.surface_distance_in_world(in_world, times_ns)
    return float(np.sqrt(np.mean(distance**2)))

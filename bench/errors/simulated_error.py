"""The simulated error of points: their displacement from the true ends of their beams.

What is constant in a recording (delays, mount, wheels) is set to the points of a cubature, which
have the given standard deviations exactly. A hundred random draws would have them to 7 %.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
import math

from nodlidar_assembler.bags.sensor_log import outcomes
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE
from nodlidar_assembler.clouds.pipeline import PipelineConfig
from nodlidar_assembler.clouds.points import place
from nodlidar_common.arrays import Array, Mask
from nodlidar_common.stamps import NS_PER_S
from nodlidar_demo.simulated_log import simulated_log, simulated_odometry
from nodlidar_planner.error_budget.parameters import ErrorParameters
from nodlidar_sim.simulation import Recording
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.odometry import Base, Odometer
import numpy as np

from bench.errors.budget_setups import SetUp
from bench.shared.reference import START_NS

IN_CLOUD = 8  # scans
WARM_UP, COOL_DOWN = 8, 4  # scans; trajectory learns, and needs samples after a scan


@dataclass(frozen=True, slots=True)
class Constant:
    """Errors that are constant in a recording: delays [s], place [m] and angles [rad]."""

    joint_delay: float
    scan_delay: float
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]


def constants(given: ErrorParameters) -> Iterator[Constant]:
    """Yield the constant errors at the points of a cubature."""
    deviations = [
        given.joint_delay_error,
        given.scan_delay_error,
        *[given.mount_position_error] * 3,
        *[given.mount_angle_error] * 3,
    ]
    for joint, scan, x, y, z, roll, pitch, yaw in cubature(deviations):
        yield Constant(joint, scan, (x, y, z), (roll, pitch, yaw))


def cubature(deviations: list[float]) -> Iterator[list[float]]:
    """Yield points sqrt(n) standard deviations out on each of n axes, to both sides.

    Their mean squares and products are those of independent errors (Arasaratnam and Haykin,
    "Cubature Kalman filters", 2009).
    """
    count = len(deviations)
    for axis, deviation in enumerate(deviations):
        for side in (1.0, -1.0):
            values = [0.0] * count
            values[axis] = side * math.sqrt(count) * deviation
            yield values


def simulated_rms(
    seen: Recording, setup: SetUp, given: ErrorParameters, chosen: Mask
) -> tuple[float, float]:
    """Return the RMS displacement [m] of the points, with measured and with true ranges."""
    truth = _true_points(seen, seen.true_pitch)
    robots = list(_robots(seen, setup))
    squares, count = np.zeros(2), 0
    for constant in constants(given):
        config = PipelineConfig(
            estimator=given.estimator,
            mixed_pixel_angle=0.0,
            laser_xyz=tuple(np.add(REFERENCE_LASER_POSE.position, constant.xyz).tolist()),
            laser_rpy=constant.rpy,
        )
        for scan, points in _assembled(seen, config, constant):
            which = chosen[scan]
            for poses in robots:
                for kind, own in enumerate(points):
                    off = poses.placed(own, scan, constant) - poses.true(truth[scan], scan)
                    squares[kind] += np.sum(off[which] ** 2)
                count += np.count_nonzero(which)
    measured, true = np.sqrt(squares / count)
    return float(measured), float(true)


def estimate_rms(seen: Recording, given: ErrorParameters, chosen: Mask) -> float:
    """Return the RMS displacement [m] that the estimate of the pitch alone causes."""
    truth, squares = _true_points(seen, seen.true_encoder_pitch), 0.0
    nothing = Constant(0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    config = PipelineConfig(estimator=given.estimator)
    for scan, (_, points) in _assembled(seen, config, nothing):
        squares += float(np.sum((points - truth[scan])[chosen[scan]] ** 2))
    return math.sqrt(squares / np.count_nonzero(chosen))


def _true_points(seen: Recording, pitch: Array) -> list[Array]:
    """Return the true ends of the beams [m], (s, b, 3), with a pitch (s, b) [rad]."""
    geometry = simulated_log(seen).scans[0].geometry
    beams = Beams(geometry, REFERENCE_LASER_POSE)
    pairs = zip(seen.true_range, pitch, strict=True)
    return [_ends(beams, *pair) for pair in pairs]


def _ends(beams: Beams, ranges: Array, pitch: Array) -> Array:
    """Return the ends of beams [m], (b, 3), NaN without a range."""
    placed = place(beams, ranges, pitch)  # type: ignore[arg-type]
    points = np.full((len(ranges), 3), np.nan)
    points[placed.indices] = placed.xyz.T
    return points


def _assembled(
    seen: Recording, config: PipelineConfig, constant: Constant
) -> Iterator[tuple[int, tuple[Array, Array]]]:
    """Yield the number of each scan, and its points [m] by measured and by true ranges, (b, 3)."""
    log, delay_ns = simulated_log(seen), round(constant.scan_delay * NS_PER_S)
    late = replace(
        log,
        scans=[replace(s, stamp_ns=s.stamp_ns + delay_ns) for s in log.scans[:-COOL_DOWN]],
        sample_ns=log.sample_ns + round(constant.joint_delay * NS_PER_S),
    )
    for number, outcome in enumerate(outcomes(late, config)):
        found = outcome.assembled
        assert found is not None or number < WARM_UP, outcome.dropped
        if found is not None:
            measured, true = (
                _ends(found.beams, each[number], found.pitch)
                for each in (seen.ranges, seen.true_range)
            )
            yield number, (measured, true)


class _Poses:
    """Places points in the frame of odometry, as of the true pose at the first point of a cloud.

    The errors of odometry before that count as errors of the map, not of the cloud.
    """

    def __init__(self, seen: Recording, odometer: Odometer | None) -> None:
        self._seen, self._moves = seen, odometer is not None
        if odometer is None:
            return
        pose = odometer.poses(seen.odometry_stamp_ns)
        self._estimate = simulated_odometry(replace(seen, odometry_pose=pose))
        self._truth = simulated_odometry(replace(seen, odometry_pose=seen.true_pose))

    def placed(self, points: Array, scan: int, constant: Constant) -> Array:
        """Return points as estimated, by stamps with a delay."""
        if not self._moves:
            return points
        delay_ns = round(constant.scan_delay * NS_PER_S)
        return self._relative(self._estimate, points, scan, delay_ns)

    def true(self, points: Array, scan: int) -> Array:
        """Return the true points."""
        return self._relative(self._truth, points, scan, 0) if self._moves else points

    def _relative(self, odometry: Odometry, points: Array, scan: int, delay_ns: int) -> Array:
        times_ns = self._seen.true_time_ns
        first = times_ns[scan // IN_CLOUD * IN_CLOUD, :1]
        in_odom = odometry.at(times_ns[scan] + delay_ns, OdometryConfig()).to_parent(points)
        origin = odometry.at(first, OdometryConfig())
        yaw = 2.0 * np.arctan2(origin.orientation[0, 2], origin.orientation[0, 3])
        c, s = np.cos(yaw), np.sin(yaw)
        x, y, z = (in_odom - origin.position[0]).T
        return np.stack([c * x + s * y, c * y - s * x, z], axis=1)


class _GivenOdometer(Odometer):
    """An odometer with given errors: shares of two wheels, then the drift [rad/s]."""

    def __init__(self, base: Base, effects: Effects, errors: list[float]) -> None:
        super().__init__(base, effects, START_NS)
        *wheels, drift = errors
        self._counted, self._drift = 1.0 + np.array(wheels), drift


def _robots(seen: Recording, setup: SetUp) -> Iterator[_Poses]:
    """Yield the poses of a robot with the errors of odometry at the points of a cubature."""
    if not any(setup.scene.base_velocity):
        yield _Poses(seen, None)
        return
    effects = setup.scene.effects
    for errors in cubature([effects.odometry_error] * 2 + [effects.heading_drift]):
        yield _Poses(seen, _GivenOdometer(seen.world.base, effects, errors))

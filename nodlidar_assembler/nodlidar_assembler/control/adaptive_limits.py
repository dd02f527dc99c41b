"""Adaptive limits: the nod for the range ahead, as the scans show it."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, rotated
from nodlidar_assembler.clouds.geometry import LaserPoseConfig, revolution_time
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.control.adapted_shape import AdaptedShape
from nodlidar_assembler.control.lidar_view import LidarView
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.pitch_limits import (
    PitchLimits,
    PitchLimitsConfig,
    ranges_that_count,
)
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.time_order import TIME_JUMP_NS
import numpy as np


@dataclass(frozen=True)
class AdaptiveLimitsConfig(OdometryConfig, LaserPoseConfig, PitchLimitsConfig):
    """What limits that follow the range depend on."""


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where the robot was: time [ns], and position in the frame of odometry [m], shape (3,)."""

    time_ns: int
    position: Array


class AdaptiveLimits:
    """Limits and N_s for what the scans show; restarts when time goes back."""

    def __init__(self, config: AdaptiveLimitsConfig) -> None:
        self._config = config
        self._axis_height, self._levelled = config.axis_height(config.laser_xyz), config.levelled
        self._view = LidarView(config)
        self.restart()

    def restart(self) -> None:
        """Forget all scans: the limits are the configured ones."""
        self._limits = PitchLimits(self._config)
        self._adapted = AdaptedShape(self._limits, self._view.config, self._view.task)
        self._now: _Place | None = None
        self._beam_period = 0.0
        self._last_ns = 0

    def add(self, assembled: Assembled, odometry: Odometry | None) -> None:
        """Add a scan.

        With odometry from its first beam on, limits are for the position of the robot at the
        newest sample. Whether it compensated the clouds does not matter.
        """
        scan, geometry = assembled.scan, assembled.beams.geometry
        if self._last_ns - scan.stamp_ns > TIME_JUMP_NS:
            self.restart()
        if self._view.look(geometry):
            self._adapted = AdaptedShape(self._limits, self._view.config, self._view.task)
        self._last_ns = max(scan.end_ns, self._last_ns)
        # Not the time between beams: a lidar that thins them has fewer beams than steps.
        self._beam_period = revolution_time(geometry) / self._view.config.steps_per_revolution
        xyz = assembled.placed.xyz.T @ self._levelled.T
        xyz[:, 2] += self._axis_height
        ranges = ranges_that_count(self._limits.config, xyz)
        if odometry is None:
            self._now = None  # the scans on the way contain the motion
        else:
            middle_ns = (scan.stamp_ns + scan.end_ns) // 2
            ranges = ranges - self._move(_place(odometry, middle_ns), odometry)
        self._limits.update(self._last_ns, ranges)

    def shape(self) -> NodShape | None:
        """Return the nod for the end of the last scan; None before the first one."""
        if self._beam_period <= 0.0:
            return None
        return self._adapted.shape(self._last_ns, self._beam_period)

    def _move(self, then: _Place, odometry: Odometry) -> float:
        """Move the limits to the newest place; return how far ahead of another it is [m]."""
        now = _place(odometry, int(odometry.time_ns[-1]))
        ahead = rotated(odometry.poses.orientation[-1:], self._levelled[:1])[0]
        self._limits.add_motion(self._forward(self._now or now, now, ahead))
        self._now = now
        return self._forward(then, now, ahead)

    def _forward(self, before: _Place, after: _Place, ahead: Array) -> float:
        """Return the motion between places along a direction [m]; 0 if odometry jumps."""
        way = after.position - before.position
        longest = self._config.max_robot_speed * (after.time_ns - before.time_ns) / NS_PER_S
        return float(ahead @ way) if np.linalg.norm(way) <= longest else 0.0


def _place(odometry: Odometry, time_ns: int) -> _Place:
    since = odometry.time_ns - time_ns
    along = [np.interp(0.0, since, axis) for axis in odometry.poses.position.T]
    return _Place(time_ns, np.array(along))

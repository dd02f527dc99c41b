"""What the scans show: pitch limits for the range ahead, and observed coverage."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, rotated
from nodlidar_assembler.clouds.geometry import LaserPoseConfig, revolution_time
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.control.lidar_view import LidarView
from nodlidar_assembler.control.nod_adaptation import NodAdaptation
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.observed_coverage import (
    Covered,
    MAX_FINEST_CELLS,
    ObservedCoverage,
)
from nodlidar_assembler.control.pitch_limits import (
    PitchLimits,
    PitchLimitsConfig,
    ranges_that_count,
)
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.parameters import parameter
from nodlidar_common.time_order import TIME_JUMP_NS
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class SceneMonitorConfig(OdometryConfig, LaserPoseConfig, PitchLimitsConfig):
    """Observed coverage."""

    coverage_window: float = parameter(
        10.0,
        'Time over which observed coverage is computed for ~/coverage and /diagnostics; with 0 it '
        'is not computed',
        unit='s',
        minimum=0.0,
        maximum=600.0,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where the robot was: time [ns], and position in the frame of odometry [m], shape (3,)."""

    time_ns: int
    position: NDArray[np.float64]


class SceneMonitor:
    """Keeps limits and coverage up to date, scan by scan; restarts when time goes back."""

    def __init__(self, config: SceneMonitorConfig) -> None:
        self._config = config
        self._axis_height, self._levelled = config.axis_height(config.laser_xyz), config.levelled
        self._view = LidarView(config)
        self.restart()

    def restart(self) -> None:
        """Forget all scans."""
        self.restart_limits()
        self._restart_coverage()
        self._beam_period = 0.0
        self._last_ns = 0

    def _restart_coverage(self) -> None:
        self._coverage: ObservedCoverage | None = None
        if self._config.coverage_window > 0.0:
            nod, task = self._view.config, self._view.task
            rows = min(nod.samples_per_sweep, MAX_FINEST_CELLS // nod.steps_per_revolution)
            self._coverage = ObservedCoverage(task, rows, self._config.coverage_window)

    def plan(self, config: SceneMonitorConfig) -> None:
        """Begin anew for another planned nod."""
        self._config = config
        self._view.plan(config)
        self.restart()

    def restart_limits(self) -> None:
        """Restart the limits from the configured ones; coverage stays."""
        self._limits = PitchLimits(self._config)
        self._adaptation = NodAdaptation(self._limits, self._view.config, self._view.task)
        self._now: _Place | None = None

    def cover(self, assembled: Assembled) -> None:
        """Add a scan to the observed coverage."""
        scan, beams = assembled.scan, assembled.beams
        if self._last_ns - scan.stamp_ns > TIME_JUMP_NS:
            self.restart()
        if self._view.look(beams.geometry):
            self._restart_coverage()
            self._adaptation = NodAdaptation(self._limits, self._view.config, self._view.task)
        if self._coverage is not None:
            # Scans may arrive twice or out of order, and estimated stamps be slightly early.
            times_ns = np.maximum(scan.stamp_ns + beams.offset_ns, self._last_ns)
            self._coverage.add(times_ns, beams.azimuth, assembled.pitch)
        self._last_ns = max(scan.end_ns, self._last_ns)
        # Not the time between beams: a lidar that thins them has fewer beams than steps.
        steps = self._view.config.steps_per_revolution
        self._beam_period = revolution_time(beams.geometry) / steps

    def follow(self, assembled: Assembled, odometry: Odometry | None) -> None:
        """Update the limits by a scan that was covered.

        With odometry from its first beam on, they are for the position of the robot at the newest
        sample. Whether it compensated the clouds does not matter.
        """
        xyz = assembled.placed.xyz.T @ self._levelled.T
        xyz[:, 2] += self._axis_height
        ranges = ranges_that_count(self._limits.config, xyz)
        if odometry is None:
            self._now = None  # the scans on the way contain the motion
        else:
            middle_ns = (assembled.scan.stamp_ns + assembled.scan.end_ns) // 2
            ranges = ranges - self._move(_place(odometry, middle_ns), odometry)
        self._limits.update(self._last_ns, ranges)

    def covered(self) -> Covered:
        """Return the observed coverage of the window of time up to the last scan.

        Raises
        ------
        ParameterError
            If coverage_window is 0.
        """
        if self._coverage is None:
            raise ParameterError('coverage_window', 'above 0 s for observed coverage', 0.0)
        return self._coverage.covered()

    def shape(self) -> NodShape | None:
        """Return the nod for the end of the last scan; None before the first one."""
        if self._beam_period <= 0.0:
            return None
        return self._adaptation.shape(self._last_ns, self._beam_period)

    def _move(self, then: _Place, odometry: Odometry) -> float:
        """Move the limits to the newest place; return how far ahead of another it is [m]."""
        now = _place(odometry, int(odometry.time_ns[-1]))
        ahead = rotated(odometry.poses.orientation[-1:], self._levelled[:1])[0]
        self._limits.add_motion(self._forward(self._now or now, now, ahead))
        self._now = now
        return self._forward(then, now, ahead)

    def _forward(self, before: _Place, after: _Place, ahead: NDArray[np.float64]) -> float:
        """Return the motion between places along a direction [m]; 0 if odometry jumps."""
        way = after.position - before.position
        longest = self._config.max_robot_speed * (after.time_ns - before.time_ns) / NS_PER_S
        return float(ahead @ way) if np.linalg.norm(way) <= longest else 0.0


def _place(odometry: Odometry, time_ns: int) -> _Place:
    since = odometry.time_ns - time_ns
    along = [np.interp(0.0, since, axis) for axis in odometry.poses.position.T]
    return _Place(time_ns, np.array(along))

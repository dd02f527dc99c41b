"""What the scans show: the pitch limits to take, and what was covered."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, rotated
from nodlidar_assembler.clouds.geometry import Beams, MountConfig, revolution_time
from nodlidar_assembler.clouds.pipeline import Assembled, Scan
from nodlidar_assembler.clouds.turns import TIME_JUMP_NS
from nodlidar_assembler.control.nod_adaptation import NodAdaptation
from nodlidar_assembler.control.nod_clock import NodShape
from nodlidar_assembler.control.nod_controller import NodConfig
from nodlidar_assembler.control.pitch_limits import (
    PitchLimits,
    PitchLimitsConfig,
    ranges_that_count,
)
from nodlidar_assembler.control.runtime_coverage import Covered, MAX_FINEST_CELLS, RuntimeCoverage
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.parameters import parameter
import numpy as np
from numpy.typing import NDArray

# The least span of adapted limits [rad]; less only where the configured limits are less apart.
LEAST_SPAN = 0.2
AHEAD = np.array([[1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class SceneMonitorConfig(OdometryConfig, MountConfig, NodConfig):
    """Adaptive limits and observed coverage."""

    adapt_limits: bool = parameter(
        False,
        'Let the limits of the nod follow the median range ahead, so that a band of heights stays '
        'covered; never beyond pitch_min and pitch_max',
        live=True,
    )
    band_bottom: float = parameter(
        0.1,
        'Lower end of the band of heights above the floor; lower points do not count',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    band_top: float = parameter(
        2.0,
        'Upper end of the band of heights',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    sensor_height: float = parameter(
        1.08,
        'Height of the optical centre above the floor at pitch 0',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    limits_rate: float = parameter(
        1.0,
        'Fastest change of an adapted limit',
        unit='rad/s',
        minimum=0.01,
        maximum=100.0,
    )
    coverage_window: float = parameter(
        10.0,
        'Time over which observed coverage is computed for ~/coverage and /diagnostics; with 0 it '
        'is not computed',
        unit='s',
        minimum=0.0,
        maximum=600.0,
    )

    def check_together(self) -> None:
        """Raise ParameterError for a band of heights without a height."""
        if self.band_top <= self.band_bottom:
            limit = f'above band_bottom = {self.band_bottom} m'
            raise ParameterError('band_top', limit, self.band_top)


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Where the robot was: time [ns], and position in the frame of odometry [m], shape (3,)."""

    time_ns: int
    position: NDArray[np.float64]


class SceneMonitor:
    """Keeps up, scan by scan, what the nod is chosen from; starts anew when time goes back.

    Parameters
    ----------
    config
        Of the assembler.
    """

    def __init__(self, config: SceneMonitorConfig) -> None:
        self._config = config
        self._optical_height = config.laser_xyz[2]
        self.restart()

    def restart(self) -> None:
        """Forget all scans."""
        config = self._config
        self.restart_limits()
        rows = min(config.samples_per_sweep, MAX_FINEST_CELLS // config.steps_per_revolution)
        self._coverage: RuntimeCoverage | None = None
        if config.coverage_window > 0.0:
            self._coverage = RuntimeCoverage(config.task, rows, config.coverage_window)
        self._beam_period = 0.0
        self._last_ns = 0

    def restart_limits(self) -> None:
        """Let the limits set out from the configured ones; what was covered stays."""
        config = self._config
        span = config.pitch_max - config.pitch_min
        self._limits = PitchLimits(
            PitchLimitsConfig(
                z_top=config.band_top,
                z_bottom=config.band_bottom,
                z_sensor=config.sensor_height,
                pitch_min=config.pitch_min,
                pitch_max=config.pitch_max,
                least_span=min(LEAST_SPAN, span),
                rate=config.limits_rate,
            )
        )
        self._adaptation = NodAdaptation(
            self._limits,
            config.task,
            config.samples_per_sweep,
            config.max_nod_speed,
            config.max_nod_acceleration,
            config.timing_error,
        )
        self._now: _Place | None = None

    def add_scan(self, scan: Scan, beams: Beams, pitch: NDArray[np.float64]) -> None:
        """Add a scan, and the pitch of its beams [rad], to what was covered."""
        if self._last_ns - scan.stamp_ns > TIME_JUMP_NS:
            self.restart()
        if self._coverage is not None:
            # Scans may come twice or out of order, and estimated stamps be a little too early.
            times_ns = np.maximum(scan.stamp_ns + beams.offset_ns, self._last_ns)
            self._coverage.add(times_ns, beams.azimuth, pitch)
        self._last_ns = max(scan.stamp_ns + beams.duration_ns, self._last_ns)
        # Not the time between beams, which are fewer than steps where the lidar thins them.
        self._beam_period = revolution_time(beams.geometry) / self._config.steps_per_revolution

    def follow(self, assembled: Assembled) -> None:
        """Let the limits follow a scan that was added.

        With odometry, up to its newest sample, they are for where the robot is by then.
        """
        odometry = assembled.odometry
        xyz = assembled.placed.xyz.T.copy()
        xyz[:, 2] += self._config.sensor_height - self._optical_height
        ranges = ranges_that_count(self._limits.config, xyz)
        if odometry is None:
            self._now = None  # the way from there is in what is seen on it
        else:
            middle_ns = assembled.scan.stamp_ns + assembled.beams.duration_ns // 2
            ranges = ranges - self._move(_place(odometry, middle_ns), odometry)
        self._limits.update(self._last_ns, ranges)

    def covered(self) -> Covered:
        """Return what the window of time up to the last scan has covered.

        Raises
        ------
        ParameterError
            If coverage_window is 0.
        """
        if self._coverage is None:
            raise ParameterError('coverage_window', 'above 0 s to tell of coverage', 0.0)
        return self._coverage.covered()

    def shape(self) -> NodShape | None:
        """Return the nod to take at the end of the last scan; None before the first one."""
        if self._beam_period <= 0.0:
            return None
        return self._adaptation.shape(self._last_ns, self._beam_period)

    def _move(self, then: _Place, odometry: Odometry) -> float:
        """Tell the limits of the newest place; return how far ahead of another it is [m]."""
        now = _place(odometry, int(odometry.time_ns[-1]))
        ahead = rotated(odometry.poses.orientation[-1:], AHEAD)[0]
        self._limits.moved(self._forward(self._now or now, now, ahead))
        self._now = now
        return self._forward(then, now, ahead)

    def _forward(self, before: _Place, after: _Place, ahead: NDArray[np.float64]) -> float:
        """Return the way from place to place along a direction [m]; 0 where odometry jumps."""
        way = after.position - before.position
        longest = self._config.max_robot_speed * (after.time_ns - before.time_ns) / NS_PER_S
        return float(ahead @ way) if np.linalg.norm(way) <= longest else 0.0


def _place(odometry: Odometry, time_ns: int) -> _Place:
    since = odometry.time_ns - time_ns
    along = [np.interp(0.0, since, axis) for axis in odometry.poses.position.T]
    return _Place(time_ns, np.array(along))

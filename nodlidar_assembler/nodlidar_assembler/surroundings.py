"""What the scans show of the surroundings: the pitch limits to take, and what was covered."""

from nodlidar_assembler.assembly import assemble
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ego_motion import Poses, rotated
from nodlidar_assembler.geometry import Beams, revolution_time
from nodlidar_assembler.nod_adaptation import NodAdaptation
from nodlidar_assembler.nod_clock import NodShape
from nodlidar_assembler.pipeline import Scan
from nodlidar_assembler.pitch_limits import PitchLimits, PitchLimitsConfig, ranges_that_count
from nodlidar_assembler.runtime_coverage import Covered, MAX_FINEST_CELLS, RuntimeCoverage
import numpy as np
from numpy.typing import NDArray

# The least span of adapted limits [rad]; less only where the configured limits are less apart.
LEAST_SPAN = 0.2


class Surroundings:
    """Keeps up, scan by scan, what the nod is chosen from; starts anew when time goes back.

    Parameters
    ----------
    config
        Of the assembler.
    """

    def __init__(self, config: AssemblerConfig) -> None:
        self._config = config
        self._optical_height = config.laser_xyz[2]
        self.restart()

    def restart(self) -> None:
        """Forget all scans."""
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
            config.timing_error,
        )
        rows = min(config.samples_per_sweep, MAX_FINEST_CELLS // config.steps_per_revolution)
        self._coverage = RuntimeCoverage(config.task, rows, config.coverage_window)
        self._beam_period = 0.0
        self._stamp_ns: int | None = None
        self._last_ns = 0
        self._position: NDArray[np.float64] | None = None

    def add_scan(self, scan: Scan, beams: Beams, pitch: NDArray[np.float64]) -> None:
        """Add a scan, and the pitch of its beams [rad], to what was covered."""
        if self._stamp_ns is not None and scan.stamp_ns <= self._stamp_ns:
            self.restart()
        geometry = beams.geometry
        azimuth = geometry.angle_min + geometry.angle_increment * np.arange(
            geometry.beams, dtype=np.float64
        )
        # Stamps that are estimated anew may let a scan begin just before the last one's end.
        times_ns = np.maximum(scan.stamp_ns + beams.offset_ns, self._last_ns)
        self._stamp_ns, self._last_ns = scan.stamp_ns, int(times_ns[-1])
        # Not the time between beams, which are fewer than steps where the lidar thins them.
        self._beam_period = revolution_time(geometry) / self._config.steps_per_revolution
        self._coverage.add(times_ns, azimuth, pitch)

    def follow(
        self, scan: Scan, beams: Beams, pitch: NDArray[np.float64], poses: Poses | None
    ) -> None:
        """Let the limits follow a scan that was added; with odometry, the poses at its beams."""
        if poses is not None:
            self._move(poses)
        points = assemble(beams, scan.stamp_ns, scan.ranges, pitch).data
        height = points['z'] + (self._config.sensor_height - self._optical_height)
        xyz = np.stack([points['x'], points['y'], height], axis=1).astype(np.float64)
        self._limits.update(scan.stamp_ns, ranges_that_count(self._limits.config, xyz))

    def covered(self) -> Covered:
        """Return what the window of time up to the last scan has covered."""
        return self._coverage.covered()

    def shape(self) -> NodShape | None:
        """Return the nod to take at the end of the last scan; None before the first one."""
        if self._beam_period <= 0.0:
            return None
        return self._adaptation.shape(self._last_ns, self._beam_period)

    def _move(self, poses: Poses) -> None:
        """Tell the limits how far forward the robot has come since the scan before."""
        if self._position is not None:
            ahead = rotated(poses.orientation[:1], np.array([[1.0, 0.0, 0.0]]))[0]
            self._limits.moved(float(ahead @ (poses.position[0] - self._position)))
        self._position = poses.position[0]

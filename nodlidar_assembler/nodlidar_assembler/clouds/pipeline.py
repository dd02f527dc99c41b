"""The method: a scan that is bracketed by joint samples to points, and points to clouds."""

from dataclasses import dataclass, replace

from nodlidar_assembler.clouds.deskew import DESKEW_INSTANTS, deskewed
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, Poses
from nodlidar_assembler.clouds.geometry import Beams, LaserPoseConfig, ScanGeometry
from nodlidar_assembler.clouds.mixed_pixels import find_mixed_pixels, MixedPixelConfig
from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, PitchEstimator
from nodlidar_assembler.clouds.point_layout import DESKEWED_POINT, MOVED_POINT, POINT
from nodlidar_assembler.clouds.point_sigma import nod_speed, point_sigma, SigmaConfig
from nodlidar_assembler.clouds.points import place, Placed, Points, points_of
from nodlidar_assembler.clouds.repeats import RepeatCheck
from nodlidar_assembler.clouds.reversals import ReversalFinder
from nodlidar_assembler.clouds.sweeps import SweepGatherer
from nodlidar_common.arrays import Array, Times
from nodlidar_common.parameters import parameter
from nodlidar_common.silence import Silence
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from numpy.typing import NDArray

# A cloud ends after this time [s] even if the nod stands still.
LONGEST_SWEEP = 30.0

CLOUD_MODES = ('scan', 'sweep')
EGO_MOTION_MODES = ('off', 'beam', 'deskew')


@dataclass(frozen=True)
class PipelineConfig(
    OdometryConfig, LaserPoseConfig, SigmaConfig, MixedPixelConfig, EstimatorConfig
):
    """Clouds."""

    cloud_mode: str = parameter(
        'scan',
        'One cloud per scan, or per sweep, from one reversal of the nod to the next',
        choices=CLOUD_MODES,
    )
    sweeps_per_cloud: int = parameter(
        1,
        'Sweeps in one cloud if cloud_mode is sweep; no cloud lasts longer than 30 s, nor, while '
        'the nod rests, than twice the usual time',
        minimum=1,
        maximum=100,
    )
    ego_motion: str = parameter(
        'off',
        'off: clouds in frame_id; beam: clouds in odom_frame, every beam from the pose of the '
        'robot at its instant, by odometry from TF; deskew: the same points in frame_id as of one '
        'instant, for SLAM',
        choices=EGO_MOTION_MODES,
    )
    deskew_to: str = parameter(
        'last',
        'With ego_motion deskew: all points of a cloud are as of the instant of its first or last '
        'point, which is its stamp',
        choices=tuple(DESKEW_INSTANTS),
    )
    time_in_compensated_clouds: bool = parameter(
        False,
        'Keep the field time in clouds in odom_frame; a program that reads it may compensate the '
        'motion again',
    )


@dataclass(frozen=True, slots=True)
class Scan:
    """One scan: instant of its first beam [ns], its geometry, ranges [m] and intensities, (n,)."""

    stamp_ns: int
    geometry: ScanGeometry
    ranges: NDArray[np.float32]
    intensities: NDArray[np.float32] | None = None

    @property
    def end_ns(self) -> int:
        """Instant of its last beam [ns]."""
        duration = (self.geometry.beams - 1) * self.geometry.time_increment
        return self.stamp_ns + round(duration * NS_PER_S)


@dataclass(frozen=True, slots=True)
class Assembled:
    """A scan with the pitch and end point of each beam.

    Attributes
    ----------
    scan, beams
        The scan, and its beams in the nodding frame.
    pitch
        Pitch of each beam [rad], shape (n,).
    placed
        End points of the beams in nodlidar_base_link.
    points
        The points of this scan alone, to be deskewed if they have poses.
    clouds
        Clouds that this scan completed.
    in_odometry
        Whether its points are in the frame of odometry, else in nodlidar_base_link.
    poses
        Poses of nodlidar_base_link in the frame of odometry at each beam's instant, shape (n,);
        None without compensation.
    jumped
        Whether odometry has jumped since the scan before: no cloud may join the two.
    """

    scan: Scan
    beams: Beams
    pitch: Array
    placed: Placed
    points: Points
    clouds: list[Points]
    in_odometry: bool = False
    poses: Poses | None = None
    jumped: bool = False


class Pipeline:
    """Turns each scan into points and, if clouds are per sweep, gathers them.

    Attributes
    ----------
    estimator
        Estimator of the pitch of each beam.
    mixed_pixels
        Number of points removed as mixed pixels.
    """

    def __init__(self, config: PipelineConfig) -> None:
        self.mixed_pixels = 0
        self._config = config
        self.estimator = PitchEstimator(config)
        self._laser_pose, self._elevation = config.laser_pose, config.beam_elevation
        self._deskews, self._deskew_to = config.ego_motion == 'deskew', config.deskew_to
        self._moved_point = POINT if config.time_in_compensated_clouds else MOVED_POINT
        self._beams: Beams | None = None
        self._repeats = RepeatCheck()
        self._reversals = ReversalFinder()
        self._silence = Silence()  # of scans, by their stamps
        self._sweeps: SweepGatherer | None = None
        if config.cloud_mode == 'sweep':
            self._sweeps = SweepGatherer(LONGEST_SWEEP, config.sweeps_per_cloud)

    def beams(self, geometry: ScanGeometry) -> Beams:
        """Return the beams of a geometry, recomputed only when it changes."""
        if self._beams is None or self._beams.geometry != geometry:
            self._beams = Beams(geometry, self._laser_pose, self._elevation)
        return self._beams

    def restart(self) -> None:
        """Restart, as after the clock was set; a cloud that is being gathered ends here."""
        self._reversals = ReversalFinder()
        self._silence = Silence()
        if self._sweeps is not None:
            self._sweeps.restart()

    def command_sweeps(self, duration: float) -> None:
        """Note how long a sweep of the commanded nod takes [s]; see SweepGatherer."""
        if self._sweeps is not None:
            self._sweeps.commanded_ns = round(duration * NS_PER_S)

    def add_sample(self, time_ns: int, pitch: float) -> None:
        """Add a joint sample [ns], [rad], in which the reversals that end clouds are found."""
        if self._sweeps is None:
            return
        reversal_ns = self._reversals.add(time_ns, pitch)
        if reversal_ns is not None:
            self._sweeps.add_reversal(reversal_ns)

    def add_scan(
        self,
        scan: Scan,
        sample_ns: Times,
        sample_pitch: Array,
        odometry: Odometry | None = None,
        jumped: bool = False,
    ) -> Assembled:
        """Assemble a scan from the joint samples around it.

        With odometry of nodlidar_base_link, each beam is placed by the pose at its own instant:
        in the frame of odometry, or, deskewed, in nodlidar_base_link as of one instant. A cloud
        that is being gathered ends where odometry has jumped, and where scans were missing for a
        while: the nod and the robot may have stood still, or moved on, meanwhile.

        Parameters
        ----------
        scan
            The scan.
        sample_ns, sample_pitch
            Joint samples that bracket it [ns], [rad], shape (m,).
        odometry
            Odometry that brackets it; None to leave the points in nodlidar_base_link.
        jumped
            Whether odometry has jumped since the scan before.

        Raises
        ------
        PitchError
            If the joint samples do not determine the pitch of every beam.
        OdometryError
            If odometry does not determine the pose at every beam.
        RepeatedScanError
            If it has the ranges of the scan before, at another pitch.
        """
        beams = self.beams(scan.geometry)
        poses = None
        if odometry is not None:  # first: if it fails, the estimator must not have learned yet
            poses = odometry.at(scan.stamp_ns + beams.offset_ns, self._config)
        pitch = self.estimator.pitch(scan.stamp_ns, beams.offset, sample_ns, sample_pitch)
        self._repeats.check(scan.geometry, scan.ranges, pitch)
        placed = place(beams, self._without_mixed_pixels(scan), pitch)
        placed = self._with_sigma(placed, scan, beams, pitch)
        points = self._points(scan, placed, beams, poses)
        in_odometry = poses is not None and not self._deskews
        silent = self._silence.seconds(scan.stamp_ns)
        self._silence.heard(scan.stamp_ns)
        if (jumped or silent) and self._sweeps is not None:
            self._sweeps.end()
        clouds = [points] if len(points.data) else []
        if self._sweeps is not None:
            clouds = self._sweeps.add_scan(points)
        clouds = [deskewed(cloud, self._deskew_to) for cloud in clouds]
        return Assembled(scan, beams, pitch, placed, points, clouds, in_odometry, poses, jumped)

    def flush(self) -> list[Points]:
        """Return the clouds that are left when no more scans come, also that of an open sweep."""
        left = [] if self._sweeps is None else self._sweeps.flush()
        return [deskewed(cloud, self._deskew_to) for cloud in left]

    def _points(self, scan: Scan, placed: Placed, beams: Beams, poses: Poses | None) -> Points:
        given = placed, beams, scan.stamp_ns, scan.intensities
        if poses is None:
            return points_of(*given)
        if not self._deskews:
            return points_of(*given, poses, self._moved_point)
        return replace(points_of(*given, point=DESKEWED_POINT), poses=poses.take(placed.indices))

    def _with_sigma(self, placed: Placed, scan: Scan, beams: Beams, pitch: Array) -> Placed:
        """Return end points with their expected errors, if these are wanted."""
        if not self._config.sigma_field:
            return placed
        ranges, speed = scan.ranges[placed.indices], nod_speed(beams, pitch)[placed.indices]
        return replace(placed, sigma=point_sigma(self._config, ranges, placed.xyz, speed))

    def _without_mixed_pixels(self, scan: Scan) -> NDArray[np.float32]:
        """Return the ranges of a scan, NaN for mixed pixels."""
        if not self._config.mixed_pixel_angle:
            return scan.ranges
        mixed = find_mixed_pixels(scan.ranges, scan.geometry, self._config)
        self.mixed_pixels += int(np.count_nonzero(mixed))
        return np.where(mixed, np.float32(np.nan), scan.ranges)

"""Where beams end for given calibration values, and how the ends move with each of them."""

from dataclasses import dataclass, replace
import math

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.geometry import (
    Beams,
    directions,
    LaserPoseConfig,
    REFERENCE_LASER_POSE,
)
from nodlidar_assembler.clouds.mixed_pixels import find_mixed_pixels, MixedPixelConfig
from nodlidar_assembler.clouds.pitch import PitchError
from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, PitchEstimator
from nodlidar_assembler.clouds.points import nod_in_place
from nodlidar_common.arrays import Array, Integers, Mask
from nodlidar_common.errors import NodlidarError
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from transforms3d.euler import euler2mat

GRID_NS = 1_000_000  # 200 rad/s2 bend a chord of 1 ms by 25 microrad
_WINDOW = 100  # steps of the grid that are smoothed together
LONGEST_PAUSE_NS = 60 * NS_PER_S  # of joint states, over which the grid would take too much
_AT_EDGE = 2  # beams beside a mixed pixel that do not count
_PREPARED = 100_000  # beams; of n times as many, every n-th one counts


class CalibrationError(NodlidarError):
    """A recording from which nothing can be calibrated."""


@dataclass(frozen=True, slots=True)
class Values:
    """The calibration.

    Attributes
    ----------
    delay
        Delay of joint state stamps minus that of scan stamps [s]; only the difference counts.
    zero
        Joint position at pitch 0 [rad], positive up.
    roll, pitch, yaw
        Orientation of the lidar in the nodding frame [rad].
    x, y, z
        Optical centre of the lidar in the nodding frame [m].
    elevation
        Angle at which beams rise out of the lidar's plane [rad].
    offset
        Added to each range [m].
    """

    delay: float
    zero: float
    roll: float
    pitch: float
    yaw: float
    x: float
    y: float
    z: float
    elevation: float = 0.0
    offset: float = 0.0

    def moved(self, names: tuple[str, ...], steps: Array) -> 'Values':
        """Return the values with steps added to the named ones."""
        pairs = zip(names, steps.tolist(), strict=True)
        return replace(self, **{name: getattr(self, name) + step for name, step in pairs})

    @classmethod
    def of_laser(cls, laser: LaserPoseConfig, delay: float = 0.0, zero: float = 0.0) -> 'Values':
        """Return the values of a pose of the lidar, a delay [s] and a joint zero [rad]."""
        return cls(delay, zero, *laser.laser_rpy, *laser.laser_xyz, laser.beam_elevation)


@dataclass(frozen=True, slots=True)
class JointTrack:
    """The smoothed positions of a joint on a grid of time.

    Attributes
    ----------
    begin_ns
        Time of the first one [ns].
    position, speed
        At every GRID_NS [rad, rad/s], shape (n,); NaN where samples are missing.
    """

    begin_ns: int
    position: Array
    speed: Array

    @classmethod
    def of(cls, log: SensorLog, max_gap: float) -> 'JointTrack':
        """Return the track of a log's joint samples, smoothed by the estimator `trajectory`.

        It is NaN where samples are farther apart than max_gap [s]; CalibrationError is raised if
        they pause for LONGEST_PAUSE_NS.
        """
        pause_ns = int(np.diff(log.sample_ns).max(initial=0))
        if pause_ns > LONGEST_PAUSE_NS:
            raise CalibrationError(
                f'joint states pause for {pause_ns / NS_PER_S:.0f} s: none came, or the clock was '
                'set; record anew, or cut the bag there'
            )
        if not len(log.sample_ns):
            raise CalibrationError('there are no joint states')
        config = EstimatorConfig(estimator='trajectory', max_joint_gap=max_gap)
        estimator = PitchEstimator(config)
        begin_ns, end_ns = int(log.sample_ns[0]), int(log.sample_ns[-1])
        offset_ns, parts = np.arange(_WINDOW) * GRID_NS, []
        for start_ns in range(begin_ns, end_ns - _WINDOW * GRID_NS, _WINDOW * GRID_NS):
            margin = estimator.margin_ns
            stop_ns = start_ns + int(offset_ns[-1])
            around = log.samples_around(start_ns - margin, stop_ns + margin)
            samples = log.sample_ns[around], log.sample_pitch[around]
            try:
                parts.append(estimator.pitch(start_ns, offset_ns / NS_PER_S, *samples))
            except PitchError:
                parts.append(np.full(_WINDOW, np.nan))
        if not parts:
            raise CalibrationError('the joint states last less than 0.1 s')
        position = np.concatenate(parts)
        return cls(begin_ns, position, np.gradient(position) * (NS_PER_S / GRID_NS))

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return position [rad], speed [rad/s] at times [s] from begin_ns, (n,); NaN outside."""
        place = time * (NS_PER_S / GRID_NS)
        grid = np.arange(len(self.position))
        nothing = {'left': np.nan, 'right': np.nan}
        position = np.interp(place, grid, self.position, **nothing)
        return position, np.interp(place, grid, self.speed, **nothing)


@dataclass(frozen=True, slots=True)
class MeasuredBeams:
    """Beams with a measurement.

    Attributes
    ----------
    time
        Instants by the stamps of the scans [s], after the track's begin, shape (n,).
    azimuth, ranges
        [rad] and [m], shape (n,).
    scan
        Number of the scan, shape (n,).
    track
        Positions of the joint.
    """

    time: Array
    azimuth: Array
    ranges: Array
    scan: Integers
    track: JointTrack

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def of(
        cls,
        log: SensorLog,
        max_range: float = np.inf,
        max_gap: float = EstimatorConfig.max_joint_gap,
    ) -> 'MeasuredBeams':
        """Return beams of a log up to a range [m], without those at edges; not all if many.

        Joint samples are at most max_gap [s] apart.
        """
        track, parts = JointTrack.of(log, max_gap), []
        step = max(1, sum(len(scan.ranges) for scan in log.scans) // _PREPARED)
        for number, scan in enumerate(log.scans):
            beams = Beams(scan.geometry, REFERENCE_LASER_POSE)
            g = scan.geometry
            good = g.measured(scan.ranges) & (scan.ranges <= max_range)
            edge = find_mixed_pixels(scan.ranges, g, MixedPixelConfig())
            near = np.convolve(edge, np.ones(2 * _AT_EDGE + 1))[_AT_EDGE:-_AT_EDGE] > 0.5
            which = np.flatnonzero(good & ~near)[number % step :: step]
            time = (scan.stamp_ns - track.begin_ns + beams.offset_ns[which]) / NS_PER_S
            numbers = np.full(len(which), float(number))
            parts.append([time, beams.azimuth[which], scan.ranges[which], numbers])
        if not parts:
            raise CalibrationError('there are no scans')
        time, azimuth, ranges, scan_number = np.concatenate(parts, axis=1).astype(np.float64)
        return cls(time, azimuth, ranges, scan_number.astype(np.int64), track)

    def __getitem__(self, which: Mask | slice) -> 'MeasuredBeams':
        time, azimuth, ranges = self.time[which], self.azimuth[which], self.ranges[which]
        return MeasuredBeams(time, azimuth, ranges, self.scan[which], self.track)


@dataclass(frozen=True, slots=True)
class Ends:
    """Ends of beams in nodlidar_base_link, shape (3, n), NaN where the pitch is unknown.

    Attributes
    ----------
    xyz
        The ends [m].
    ways
        Unit vectors along the beams.
    moves
        Derivatives by the calibration's values, by their names.
    """

    xyz: Array
    ways: Array
    moves: dict[str, Array]


def ends_of(beams: MeasuredBeams, values: Values, with_moves: bool = True) -> Ends:
    """Return where beams end.

    ``R(phi) (Rz(yaw) Ry(pitch) Rx(roll) u r + (x, y, z))`` with u of `directions`, R(phi) the
    rotation up by the pitch, phi = position(time + delay) - zero: see `place`.
    """
    position, speed = beams.track.at(beams.time + values.delay)
    rotation = np.asarray(euler2mat(values.roll, values.pitch, values.yaw, axes='sxyz'))
    one, nothing = np.ones(len(beams)), np.zeros(len(beams))
    direction = rotation @ directions(beams.azimuth, values.elevation)
    ranges = beams.ranges + values.offset
    vectors = {
        'xyz': direction * ranges + np.array([[values.x], [values.y], [values.z]]),
        'ways': direction,
    }
    if with_moves:
        vectors |= {
            'roll': np.cross(rotation[:, 0], direction.T).T * ranges,
            'yaw': np.stack([-direction[1], direction[0], nothing]) * ranges,
            'x': np.stack([one, nothing, nothing]),
            'z': np.stack([nothing, nothing, one]),
            # A beam that rises turns towards the one that is a right angle higher.
            'elevation': rotation
            @ directions(beams.azimuth, values.elevation + math.pi / 2.0)
            * ranges,
            'offset': direction,
        }
    turned = nod_in_place(np.stack(list(vectors.values()), axis=1), position - values.zero)
    xyz, ways, *moved = turned.swapaxes(0, 1)
    if not with_moves:
        return Ends(xyz, ways, {})
    up = moved_by_pitch(xyz)
    moves = dict(zip(list(vectors)[2:], moved, strict=True))
    return Ends(xyz, ways, moves | {'delay': up * speed, 'zero': -up})


def moved_by_pitch(xyz: Array) -> Array:
    """Return how points (3, n) move with the pitch, by radian."""
    return np.stack([-xyz[2], np.zeros(xyz.shape[1]), xyz[0]])

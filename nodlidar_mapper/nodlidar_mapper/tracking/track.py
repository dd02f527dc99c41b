"""The pose of the robot: predicted by odometry, corrected by matches."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_assembler.clouds.origins import SPACING
from nodlidar_common.arrays import Array
from nodlidar_common.parameters import parameter
from nodlidar_common.stamps import NS_PER_S
from nodlidar_mapper.geometry.linear import inverted
from nodlidar_mapper.geometry.poses import (
    between,
    carried,
    change_between,
    corrected,
    inverse,
    shifted,
    turning,
)
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.tracking.matching import MatchingConfig
from nodlidar_mapper.tracking.odometry_errors import MEMORY, OdometryErrors
import numpy as np

PAUSE = 3.0  # times as long as the longest of the last times between clouds
TIMES = 4  # that are remembered; the clouds of several sensors may come in quick succession
SPEED_OVER = 0.1  # time over which the speed is measured, at least [s]
UNSTEADY = 0.5  # share of the slip along the way that is not always alike; in turns, none is
SLIPPERY = 2.0  # the same where wheels have slipped: they will again
LEAST_ERROR = 0.002, 0.001  # error of odometry that does not grow with the motion [m], [rad]
CERTAIN = np.diag([1e-10] * 6)  # covariance of what is not estimated [m^2], [rad^2]
# Covariance after a jump of odometry [m^2], [rad^2].
AFTER_JUMP = np.diag([0.2**2] * 3 + [0.1**2] * 3)


@dataclass(frozen=True)
class TrackConfig(MatchingConfig):
    """Odometry."""

    odometry_slip: float = parameter(
        0.03,
        'Standard deviation of odometry, as a share of the motion',
        minimum=0.001,
        maximum=1.0,
    )
    max_robot_speed: float = parameter(
        2.0,
        'Odometry that moves faster between two clouds counts as a jump',
        unit='m/s',
        minimum=0.1,
        maximum=100.0,
    )
    max_robot_turn_rate: float = parameter(
        4.0,
        'Odometry that turns faster between two clouds counts as a jump',
        unit='rad/s',
        minimum=0.1,
        maximum=100.0,
    )


class Track:
    """Follows the pose of the robot in the map.

    Attributes
    ----------
    pose
        Of the last cloud; None before the first one.
    covariance
        Of its change, shape (6, 6).
    jump
        Why odometry since the cloud before is not believed; empty if it is.
    paused
        Whether there was no cloud for a long time before the newest one.
    interval
        From the cloud before to the newest one [s].
    """

    def __init__(self, config: TrackConfig) -> None:
        self._config = config
        self._odometry_errors = OdometryErrors(config.odometry_slip)
        self._fixed = np.ones((6, 6), dtype=np.bool_)  # not estimated, and so not uncertain
        self._fixed[np.ix_(config.free, config.free)] = False
        self._stamp_ns = 0
        self._odometry = np.eye(4)
        self._seconds: deque[float] = deque(maxlen=TIMES)  # between clouds
        self._guess = np.eye(4)
        self._counted, self._last_motion = np.eye(4), np.eye(4)  # between the last two clouds
        self._speed_since: tuple[int, Array] | None = None
        # Rates (6,) [m/s], [rad/s]: of the robot backwards, and of the errors of odometry.
        self._back = self._miscounted = np.zeros(6)
        self._slip_memory = 0.0  # 1 where wheels have just slipped, forgotten over MEMORY
        self.pose: Array | None = None
        self.covariance = self._known = np.diag([1e-6] * 6)  # now, and after the last match
        self.jump = ''
        self.paused = False
        self.interval = SPEED_OVER

    def predicted(self, stamp_ns: int, odometry: Array, silence: float = 0.0) -> Array:
        """Return the pose by odometry since the last cloud; the covariance grows.

        If odometry jumped, the robot is expected to have moved as before. If it was silent for a
        time [s] in a pause, it is believed, but may have begun anew.
        """
        self.jump = ''
        if self.pose is None:
            self._speed_since = stamp_ns, odometry
            begin = odometry.copy()  # near the origin of the map, where float32 keeps millimetres
            begin[:3, 3] -= SPACING * np.rint(begin[:3, 3] / SPACING)
            return begin
        self._known = self.covariance
        added = self._take_motion(stamp_ns, odometry)
        if self.paused and not self.jump:
            added = added + self._unseen(silence)
        guess = self._guess = np.asarray(self.pose @ self._last_motion)
        self.covariance = carried(self.covariance, guess[:3, 3] - self.pose[:3, 3]) + added
        self.covariance[self._fixed] = CERTAIN[self._fixed]
        return guess

    def seen(self, points: Array, age: Array, lidar: Array, slip: Array | None = None) -> Seen:
        """Return deskewed points of the newest cloud without the learned errors of odometry.

        Parameters
        ----------
        points, age
            In the frame of the robot [m], shape (n, 3); time from each to that cloud [s], (n,).
        lidar
            Place of the lidar on the robot [m], shape (3,).
        slip
            Rate of a slip since the cloud before that is taken out, too, see `slip_to`.
        """
        seconds = age[:, None]
        points = shifted(points, seconds * self._miscounted)
        lidars = shifted(lidar, seconds * self._back)
        if slip is not None:
            way = np.clip(seconds, 0.0, self.interval) * slip
            points, lidars = shifted(points, way), shifted(lidars, way)
        return Seen(points, lidars, age)

    def slip_to(self, pose: Array) -> Array:
        """Return the rate (6,) at which wheels slipped [m/s], [rad/s], if the robot is at a pose.

        It is that of the predicted pose in the frame of the robot.
        """
        return change_between(np.eye(4), inverse(pose) @ self._guess) / self.interval

    def learn(self, pose: Array, information: Array, prior_weight: float = 1.0) -> None:
        """Learn the errors of odometry, and how certain the pose is, from a match.

        Parameters
        ----------
        pose
            Of the robot, by the match.
        information
            Inverse covariance of its change by the match alone, shape (6, 6).
        prior_weight
            Share of its information with which odometry counted. What it lacks is noise, and no
            error that stays.
        """
        self._slip_memory = max(self._slip_memory, 1.0 - prior_weight)
        surprise = (1.0 / prior_weight - 1.0) * self.covariance
        self._known, self.covariance = self._known + surprise, self.covariance + surprise
        if self.pose is not None and not self.jump:
            turned = self._turned
            self._odometry_errors.add(
                self._counted,
                turned.T @ change_between(self._guess, pose),
                turned.T @ information @ turned,
                turned.T @ self._known @ turned,
                turned.T @ self.covariance @ turned,
                prior_weight,
            )
        self.covariance = inverted(inverted(self.covariance) + information)

    def restarted(self, first: Sequence[tuple[int, Array]]) -> Track:
        """Return a track that begins again, with the learned errors of odometry.

        Parameters
        ----------
        first
            Stamps [ns] of its first clouds, and poses of the robot in the frame of odometry. The
            first cloud was taken at about the speed from there to the second, or to the next one
            that is not too soon.
        """
        track = Track(self._config)
        track._odometry_errors = self._odometry_errors
        for robot in first:
            track._measure_speed(*robot)
            if track._speed_since is not None and track._speed_since[0] != first[0][0]:
                break
        return track

    def move_to(self, pose: Array, stamp_ns: int, odometry: Array) -> None:
        """Continue from a pose of the robot in the map, and that in the frame of odometry."""
        self.pose, self._stamp_ns, self._odometry = pose, stamp_ns, odometry

    def moved_by(self, share: float) -> Array:
        """Return the pose after a share of the last motion, as if wheels had slipped."""
        if self.pose is None:
            return self._guess
        way = share * change_between(np.eye(4), self._last_motion)
        return np.asarray(self.pose @ corrected(np.eye(4), way))

    @property
    def _turned(self) -> Array:
        """Matrix (6, 6) that turns a change from the frame of the robot to the map."""
        assert self.pose is not None
        return turning(self.pose[:3, :3])

    def _take_motion(self, stamp_ns: int, odometry: Array) -> Array:
        """Take the motion since the last cloud; return the covariance that it adds."""
        motion = inverse(self._odometry) @ odometry
        distance, turn = between(np.eye(4), motion)
        seconds = self.interval = max(abs(stamp_ns - self._stamp_ns) / NS_PER_S, SPEED_OVER)
        config = self._config
        known = len(self._seconds) == TIMES
        paused_before, self.paused = self.paused, known and seconds > PAUSE * max(self._seconds)
        longest, most = config.max_robot_speed * seconds, config.max_robot_turn_rate * seconds
        if distance > longest or turn > most:
            self.jump = f'odometry jumped by {distance:.1f} m and {turn:.1f} rad'
            self._counted = self._last_motion
            self._speed_since = stamp_ns, odometry
            return AFTER_JUMP
        if not self.paused or paused_before:  # two in a row: clouds come more rarely now
            self._seconds.append(seconds)
        up = self._odometry[2, :3]
        self._counted, self._last_motion = motion, self._odometry_errors.corrected(motion, up)
        self._measure_speed(stamp_ns, odometry)
        shift, rotation = LEAST_ERROR
        self._slip_memory *= float(np.exp(-distance / MEMORY))
        unsteady_share = UNSTEADY + (SLIPPERY - UNSTEADY) * self._slip_memory
        slip, straight = config.odometry_slip, unsteady_share * distance
        unsteady = np.diag(
            [(shift + slip * straight) ** 2] * 3 + [(rotation + slip * (turn + straight)) ** 2] * 3
        )
        effect = self._turned @ self._odometry_errors.effect(motion)
        return np.asarray(unsteady + effect @ self._odometry_errors.covariance @ effect.T)

    def _unseen(self, silence: float) -> Array:
        """Return the covariance of a motion that nobody saw for a time [s]."""
        way = self._config.max_robot_speed * silence
        turn = min(self._config.max_robot_turn_rate * silence, np.pi)
        disc, interval = way**2 / 4.0, turn**2 / 3.0  # variances of even distributions
        return np.diag([disc, disc, 0.0, 0.0, 0.0, interval])

    def _measure_speed(self, stamp_ns: int, odometry: Array) -> None:
        """Measure the speed, unless the last one is too recent; clouds may be out of order."""
        if self._speed_since is not None:
            since_ns, before = self._speed_since
            seconds = (stamp_ns - since_ns) / NS_PER_S
            if abs(seconds) < SPEED_OVER:
                return
            counted = inverse(before) @ odometry
            back = inverse(self._odometry_errors.corrected(counted, before[2, :3]))
            self._back = change_between(np.eye(4), back) / seconds
            self._miscounted = change_between(np.eye(4), back @ counted) / seconds
        self._speed_since = stamp_ns, odometry

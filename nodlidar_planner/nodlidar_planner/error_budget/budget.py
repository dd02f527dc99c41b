"""The expected error of a point: the displacement from its true place, by first order."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from types import MappingProxyType

from nodlidar_common.arrays import Array
from nodlidar_planner.error_budget.parameters import ErrorParameters
from nodlidar_planner.error_budget.pitch_error import pitch_variance
from nodlidar_planner.error_budget.swing import Swing
from nodlidar_planner.pattern.task import Task
import numpy as np

SOURCES = (
    'range noise',
    'range bias',
    'pitch estimate',
    'backlash',
    'encoder error',
    'joint delay',
    'scan delay',
    'mount',
    'odometry',
)


@dataclass(frozen=True, slots=True, eq=False)
class Beams:
    """Ranges [m], azimuths in the scan plane [rad] and pitches [rad] of beams, shape (n,) each."""

    ranges: Array
    azimuth: Array
    pitch: Array

    @property
    def ahead(self) -> Array:
        """How far the end points are ahead of the optical centre, in the scan plane [m], (n,)."""
        return np.asarray(self.ranges * np.cos(self.azimuth))

    @property
    def aside(self) -> Array:
        """How far they are to its left [m], shape (n,)."""
        return np.asarray(self.ranges * np.sin(self.azimuth))

    def from_axis(self, laser_above: float, laser_ahead: float = 0.0) -> Array:
        """Return the squared distance [m^2] of the end points from the nod axis, shape (n,)."""
        return np.asarray((self.ahead + laser_ahead) ** 2 + laser_above**2)


class ErrorBudget:
    """Mean square displacements of points by source; the sources are independent.

    By first order, an error of the range moves a point by as much, an error e of the pitch by
    rho e, with rho its distance from the nod axis, and a delay t by rho times the speed times t.
    The derivations are in docs/error_budget.md.

    Parameters
    ----------
    parameters
        Errors of the devices.
    swing
        The nod.

    Attributes
    ----------
    pitch_variance
        Mean square error of the estimated pitch [rad^2].
    """

    def __init__(self, parameters: ErrorParameters, swing: Swing) -> None:
        self._parameters, self._swing = parameters, swing
        self.pitch_variance = pitch_variance(parameters, swing)

    def squares(self, beams: Beams) -> Mapping[str, Array]:
        """Return the mean square displacement [m^2] of each point by source, shape (n,) each."""
        p, shape = self._parameters, np.ones_like(beams.ranges)
        rho2 = beams.from_axis(p.laser_above, p.laser_ahead)
        turned = rho2 * self._swing.mean_square_speed
        values = (
            p.range_noise**2 + (p.range_noise_growth * beams.ranges) ** 2,
            p.range_bias**2 * shape,
            rho2 * self.pitch_variance,
            rho2 * (p.backlash / 2.0 + p.deflection) ** 2,
            rho2 * p.encoder_error**2,
            turned * p.joint_delay_error**2,
            (turned + self._of_driving(beams)) * p.scan_delay_error**2,
            3.0 * p.mount_position_error**2 + 2.0 * (beams.ranges * p.mount_angle_error) ** 2,
            self._of_odometry(beams),
        )
        return MappingProxyType(dict(zip(SOURCES, values, strict=True)))

    def rms(self, beams: Beams) -> dict[str, float]:
        """Return the RMS displacement [m] over all beams, by source, and 'total'."""
        squares = {name: float(np.mean(each)) for name, each in self.squares(beams).items()}
        squares['total'] = sum(squares.values())
        return {name: math.sqrt(each) for name, each in squares.items()}

    def sigma(self, beams: Beams) -> Array:
        """Return the RMS displacement [m] of each point by all sources together, shape (n,)."""
        return np.asarray(np.sqrt(np.sum(list(self.squares(beams).values()), axis=0)))

    def _of_driving(self, beams: Beams) -> Array:
        """Return the squared speed [m^2/s^2] with which the robot's motion moves the points."""
        p = self._parameters
        return p.robot_speed**2 + p.robot_turn_rate**2 * self._from_robot(beams)

    def _of_odometry(self, beams: Beams) -> Array:
        """Return the mean square displacement [m^2] against the first point of the cloud.

        Errors of speed v and turn rate w grow to v t and w t, and the wrong heading leads the
        robot aside by speed w t^2 / 2, to the side to which it turns what is ahead by x: both
        together add speed x w^2 t^3. The means of t^2, t^3 and t^4 over a cloud of time T are
        T^2 / 3, T^3 / 4 and T^4 / 5.
        """
        p, time = self._parameters, self._parameters.cloud_time
        steady = p.odometry_speed_error**2 + p.odometry_turn_error**2 * self._from_robot(beams)
        both = p.robot_speed * p.odometry_turn_error**2 * self._ahead(beams)
        aside = (p.robot_speed * p.odometry_turn_error) ** 2 / 4.0
        return np.asarray(steady * time**2 / 3.0 + both * time**3 / 4.0 + aside * time**4 / 5.0)

    def _ahead(self, beams: Beams) -> Array:
        """Return how far the points are ahead of the robot [m], about which it turns; (n,)."""
        p = self._parameters
        return np.asarray(p.mount_ahead + (beams.ahead + p.laser_ahead) * np.cos(beams.pitch))

    def _from_robot(self, beams: Beams) -> Array:
        """Return the squared horizontal distance [m^2] of the points from there, shape (n,)."""
        return np.asarray(self._ahead(beams) ** 2 + beams.aside**2)


def beams_at(task: Task, distance: float) -> Beams:
    """Return beams all over the view of a task's lidar and its limits, at one distance [m]."""
    azimuth = np.linspace(task.window_min, task.window_max, 61)
    if task.full_circle:
        azimuth = np.linspace(0.0, math.tau, 60, endpoint=False)
    pitch = np.linspace(task.pitch_min, task.pitch_max, 31)
    both = np.meshgrid(azimuth, pitch)
    return Beams(np.full_like(both[0], distance), *both)


def budget_of(task: Task, speed: float, parameters: ErrorParameters) -> ErrorBudget:
    """Return the budget of a task's lidar and limits, nodding at a speed [rad/s]."""
    swing = Swing(speed, task.span / speed, parameters.reversal_acceleration)
    return ErrorBudget(parameters, swing)

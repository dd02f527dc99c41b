"""A joint of ros2_control: its controllers and its hardware."""

from collections.abc import Callable

from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.devices.device import SilentDevice
from nodlidar_sim.devices.trajectory_controller import TrajectoryController
from nodlidar_sim.world.nod_motion import ServoShaft
import numpy as np

UPDATE_RATE = 100.0
"""Of the controller manager [Hz], as in nodlidar_bringup/config/controllers.yaml."""

FARTHEST = 1e3
"""What is commanded beyond this position [rad] or velocity [rad/s] is ignored."""


class ControlledJoint(SilentDevice):
    """A joint with a joint_trajectory_controller and a joint_state_broadcaster.

    It is a `Device` without bytes, and the motion of the lidar. In each cycle, the joint is
    measured and published, and gets the position for the end of the cycle.

    Parameters
    ----------
    shaft
        The motor: it is told positions, and nothing else.
    start_ns
        Host time of the first cycle [ns].

    Attributes
    ----------
    controller
        It accepts trajectories.
    publish
        Is called with the time of each cycle [ns], position [rad] and velocity [rad/s] by the
        encoder.
    """

    def __init__(self, shaft: ServoShaft, start_ns: int) -> None:
        self.controller = TrajectoryController()
        self.publish: Callable[[int, float, float], None] = lambda *_: None
        self._shaft = shaft
        self._next_ns = start_ns
        self._period_ns = round(NS_PER_S / UPDATE_RATE)

    def position(self, times_ns: Times) -> Array:
        """Return the pitch of the lidar [rad] at each time [ns], none of them to come."""
        self.transmit(int(np.max(times_ns)))
        return self._shaft.position(times_ns)

    def velocity(self, times_ns: Times) -> Array:
        """Return the speed of the lidar [rad/s] at each time [ns], none of them to come."""
        self.transmit(int(np.max(times_ns)))
        return self._shaft.velocity(times_ns)

    def transmit(self, now_ns: int) -> bytes:
        """Run the cycles that begin by a time [ns]; return nothing."""
        while self._next_ns <= now_ns:
            begin_ns, self._next_ns = self._next_ns, self._next_ns + self._period_ns
            measured = self._shaft.measured(begin_ns)
            self.publish(begin_ns, *measured)
            self.controller.update(begin_ns, *measured)
            goal = self.controller.at(self._next_ns)
            # A spline between finite points may not be finite, and no hardware turns that far.
            if np.isfinite(goal).all() and np.abs(goal).max() <= FARTHEST:
                self._shaft.reach(begin_ns, self._next_ns, *goal)
        return b''

    def next_event_ns(self) -> int:
        """Return when the next cycle begins [ns]."""
        return self._next_ns

"""A joint_trajectory_controller for tests, by the rules in its source.

ros2_controllers 4.42 (Jazzy): `validate_trajectory_msg`, `fill_partial_goal` and `update` in
joint_trajectory_controller.cpp, `sample` and `interpolate_between_points` in trajectory.cpp.
Position interface, splines, its other parameters at their defaults, unless given.
"""

import itertools

from nodlidar_common.stamps import time_ns
import numpy as np

JOINT = 'nod_joint'
_FIELDS = 'positions', 'velocities', 'accelerations'


class SplineController:
    """Samples the latest trajectory; before its first point, from where the joint was measured.

    Parameters
    ----------
    pitch
        Where the joint is.
    joints
        Those of the controller.
    allow_partial_joints_goal
        Parameter of the controller; the other joints are then held.
    """

    def __init__(self, pitch, joints=(JOINT,), allow_partial_joints_goal=False):
        self.joints, self.is_partial_allowed = joints, allow_partial_joints_goal
        self.before = (0, pitch, 0.0)
        self.points = []  # (time [ns], position, velocity)
        self.refusals = []

    def accept_message(self, message, now_ns):
        """Take a message at the time at which it arrives, unless it is not allowed."""
        names = message.joint_names
        if not self.is_partial_allowed and len(names) != len(self.joints):
            return self.refusals.append('not the number of joints')
        if not names or set(names) - set(self.joints):
            return self.refusals.append('not the joints')
        for point in message.points:
            lengths = [len(getattr(point, field)) for field in _FIELDS]
            if lengths[0] != len(names) or {0, len(names)} < {0, *lengths}:
                return self.refusals.append('not a value of each joint')
            if point.effort:
                return self.refusals.append('effort without an interface')
        index = names.index(JOINT)
        points = [
            (time_ns(each.time_from_start), each.positions[index], each.velocities[index])
            for each in message.points
        ]
        return self.accept(time_ns(message.header.stamp), points, now_ns)

    def accept(self, start_ns, points, now_ns, measured=None):
        """Take points (time from start [ns], position, velocity), unless they are not allowed.

        Measured are position and velocity of the joint; if None, it is where it is commanded.
        """
        if not points:
            return self.refusals.append('empty')
        if abs(points[-1][2]) > np.finfo(np.float32).eps:
            return self.refusals.append('velocity of the last point is not zero')
        if start_ns != 0 and start_ns + points[-1][0] < now_ns:
            return self.refusals.append('ends in the past')
        if np.any(np.diff([point[0] for point in points]) <= 0):
            return self.refusals.append('not strictly increasing')
        start_ns = start_ns or now_ns
        self.before = (now_ns, *(self.sample(now_ns) if measured is None else measured))
        self.points = [(start_ns + offset, *rest) for offset, *rest in points]
        return None

    def sample(self, now_ns):
        """Return position and velocity at a time."""
        segments = [self.before, *self.points] if self.points else [self.before]
        if self.points and now_ns >= self.points[0][0]:
            segments = self.points
        for begin, end in itertools.pairwise(segments):
            if begin[0] <= now_ns < end[0]:
                return _cubic(begin, end, (now_ns - begin[0]) / 1e9)
        return segments[-1][1], 0.0


def _cubic(begin, end, elapsed):
    """The polynomial of third order through two positions and velocities."""
    duration = (end[0] - begin[0]) / 1e9
    p0, v0, p1, v1 = *begin[1:], *end[1:]
    c2 = (-3.0 * p0 + 3.0 * p1 - 2.0 * v0 * duration - v1 * duration) / duration**2
    c3 = (2.0 * p0 - 2.0 * p1 + v0 * duration + v1 * duration) / duration**3
    position = p0 + v0 * elapsed + c2 * elapsed**2 + c3 * elapsed**3
    return position, v0 + 2.0 * c2 * elapsed + 3.0 * c3 * elapsed**2

"""A joint_trajectory_controller for tests, by the rules in its source.

ros2_controllers 4 (Jazzy): `validate_trajectory_msg` in joint_trajectory_controller.cpp, `sample`
and `interpolate_between_points` in trajectory.cpp. Position interface, splines, one joint.
"""

import itertools

import numpy as np


class SplineController:
    """Samples the latest trajectory; before its first point, from where the joint was."""

    def __init__(self, pitch):
        self.before = (0, pitch, 0.0)
        self.points = []  # (time [ns], position, velocity)
        self.refusals = []

    def accept(self, start_ns, points, now_ns):
        """Take points (time from start [ns], position, velocity), unless they are not allowed."""
        if not points:
            return self.refusals.append('empty')
        if abs(points[-1][2]) > np.finfo(np.float32).eps:
            return self.refusals.append('velocity of the last point is not zero')
        if start_ns != 0 and start_ns + points[-1][0] < now_ns:
            return self.refusals.append('ends in the past')
        if np.any(np.diff([point[0] for point in points]) <= 0):
            return self.refusals.append('not strictly increasing')
        self.before = (now_ns, *self.sample(now_ns))
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

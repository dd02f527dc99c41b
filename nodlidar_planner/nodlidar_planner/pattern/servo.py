"""The servo that is planned for unless another is stated, and how fast it nods."""

import math

# Assumed for a Dynamixel RX-24F with a lidar on it, not measured: speed [rad/s], acceleration
# [rad/s^2], and standard deviation of the instants at which it reverses [s].
MAX_SPEED = 6.0
MAX_ACCELERATION = 150.0
TIMING_ERROR = 0.003
# The slowest nod that it follows evenly [rad/s]; a step of its register of speeds is 0.0116 rad/s.
MIN_SPEED = 0.02
# By how much its advance may differ from revolution to revolution of the lidar [rad]: a step of
# the encoder and some backlash.
PITCH_ERROR = 0.008


def shortest_by_mean_speed(
    span: float, max_speed: float = MAX_SPEED, max_acceleration: float = MAX_ACCELERATION
) -> float:
    """Return the least time in which a servo of a mean speed gets over a span [s].

    From reversal to reversal it accelerates and brakes, which takes at least
    2 sqrt(span / max_acceleration).

    Parameters
    ----------
    span
        From limit to limit [rad].
    max_speed, max_acceleration
        Of the servo [rad/s], [rad/s^2]; the speed is the mean one of a sweep.
    """
    return max(span / max_speed, 2.0 * math.sqrt(span / max_acceleration))

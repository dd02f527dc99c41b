"""The servo that is planned for unless another is stated, and how fast it nods."""

import math

from nodlidar_common.dynamics import REVERSAL_ACCELERATION

# Assumed for a Dynamixel RX-24F with a lidar on it, not measured: speed [rad/s], acceleration
# [rad/s^2], and standard deviation of the instants at which it reverses [s]. A nod is planned for
# three quarters of what the servo reaches, so that it has some to spare.
MAX_SPEED = 6.0
MAX_ACCELERATION = 0.75 * REVERSAL_ACCELERATION
TIMING_ERROR = 0.003
# Mean speed of the nod [rad/s] that each servo is planned for, with a URG-04LX-UG01 on it, but a
# lidar of 50 g on the XL330-M077, which is weak: what they hold in simulation over
# 1.2272 rad (`python -m bench servos`). They reach the limits within 10 %, and their reversals
# scatter by less than 1 ms, but those of the RX-24F by a little more. So do AX-12A, AX-18A and
# RX-28 with the armature and friction of the RX-64, since their own are guesses, too.
MAX_SPEEDS = {
    'RX-24F': MAX_SPEED,
    'RX-28': 5.0,
    'RX-64': 3.8,
    'AX-12A': 2.8,
    'AX-18A': 3.6,
    'MX-28': 4.2,
    'MX-28-2': 4.2,
    'XL430-W250': 3.2,
    'XL330-M288': 2.3,
    'XL330-M077': 2.0,
    'STS3215': 2.9,
}
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

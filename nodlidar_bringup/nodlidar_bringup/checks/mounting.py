"""What a cloud says about the mount, in words."""

import math

from nodlidar_bringup.checks.finding import fault, Finding, good, unknown
from nodlidar_bringup.checks.graph import LAUNCH
from nodlidar_bringup.checks.orientation import AS_KNOWN, Mounting, Reversed, Seen

LEAST_FLOOR = 0.06
"""Share of the points that a floor in view has at least."""

CLEARER = 1.5
"""A sign of the joint is right if it shows so many times as much of floor and walls."""

SHARPER = 1.15
"""Walls decide if one lever arm gives so many times as many pairs as the other."""

LEAST_LEVER = 0.02
"""Lever arms below do not show in the noise of a lidar [m]."""

LEAST_ZERO = 0.055
"""A zero of the joint [rad] is off if it is farther from level: noise and height move it less."""

LEAST_PAIRS = 0.65
"""A level floor comes with walls that are upright: not with fewer pairs than so many times."""

_JOINT = (
    'ros2 run nodlidar_servo setup with --invert or --no-invert, the other one than before, or '
    'the sign in the hardware interface of ros2_control: positions have to rise with the beam'
)
_CHECK = 'mount_xyz is the nod axis in base_link, which is on the floor'


def check_mounting(seen: Seen | None, mounting: Mounting) -> list[Finding]:
    """Return how the lidar is mounted, if that is not as it is known.

    Parameters
    ----------
    seen
        What a cloud of one sweep or more shows; None if there was none.
    mounting
        The mount as it is known.
    """
    if seen is None:
        return [unknown('mount', 'too few points in front to see how the lidar is mounted')]
    if abs(mounting.lever[2]) < LEAST_LEVER:
        return [_left(seen)]
    findings = [_of_floor(seen, mounting) or _of_walls(seen, mounting)]
    return [*findings, _left(seen)]


def _of_floor(seen: Seen, mounting: Mounting) -> Finding | None:
    """Return what the floor says, if it is seen and one sign of the joint shows it best."""
    by_sign = [
        max(_with_sign(joint), key=lambda each: _evidence(seen, each)) for joint in (False, True)
    ]
    best, second = sorted(by_sign, key=lambda each: -_evidence(seen, each))
    is_floor = seen.leveled[best] >= LEAST_FLOOR and seen.leveling[best] >= LEAST_PAIRS
    if not is_floor or _evidence(seen, best) < CLEARER * _evidence(seen, second):
        return None
    likeliest = min(_with_sign(best.joint), key=lambda each: abs(seen.zeros[each]))
    if best.joint:
        return _wrong(likeliest, mounting)
    zero, share = seen.zeros[AS_KNOWN], seen.floor[AS_KNOWN]
    if abs(zero) <= LEAST_ZERO and share * CLEARER > seen.floor[likeliest]:
        return good('mount', f'the floor is where it should be, with {share:.0%} of the points')
    if abs(seen.zeros[likeliest]) <= LEAST_ZERO:
        return _wrong(likeliest, mounting, zero)
    return _off(zero)


def _with_sign(joint: bool) -> list[Reversed]:
    """Return the two mounts with a sign of the joint."""
    return [Reversed(joint, lever) for lever in (False, True)]


def _evidence(seen: Seen, mount: Reversed) -> float:
    """Return how much of a level floor and of upright walls a mount shows.

    Either alone may be much alike for both signs: a joint that dwells sees a line of the floor.
    """
    return seen.leveled[mount] * seen.leveling[mount]


def _of_walls(seen: Seen, mounting: Mounting) -> Finding:
    if seen.sharpness > SHARPER:
        return good('mount', f'walls are upright; the floor is not at -{mounting.height:g} m')
    if seen.sharpness * SHARPER > 1.0:
        text = 'the cloud does not show how the lidar is mounted: no floor, few upright walls'
        return unknown('mount', text, f'turn it to a room with a floor in view; {_CHECK}')
    text = (
        "walls lean: the joint's sign is wrong, its zero is off, or the lidar hangs below the "
        'axis and is taken for one above'
    )
    return fault('walls lean', text, f'turn the beam up by hand, torque off; {_JOINT}')


def _off(zero: float) -> Finding:
    text = f'the pitch is {zero:+.2f} rad off: the floor is tilted by as much'
    return fault('pitch off', text, _zero_remedy(zero))


def _zero_remedy(zero: float) -> str:
    return (
        f'turn the horn so that the beams are level at 0, or add {zero:+.2f} rad to joint_zero in '
        'assembler_params; if it is the mount that is tilted, to the pitch in mount_rpy'
    )


def _wrong(best: Reversed, mounting: Mounting, zero: float = 0.0) -> Finding:
    x, y, z = mounting.lever
    if best == Reversed(joint=True):
        text = "the joint's sign is wrong: with it reversed, the floor is where it should be"
        return fault('joint sign', text, _JOINT)
    if best == Reversed(lever=True):
        sides = ('below', 'above') if z > 0.0 else ('above', 'below')
        text = (
            f'the lidar is upside down: its optical centre is {sides[0]} the axis, not {sides[1]}'
        )
        remedy = f'{LAUNCH} laser_xyz:="{x:g} {y:g} {-z:g}" laser_rpy:="3.14159 0 0"'
        if zero:  # both show the floor alike
            text += f'; or the pitch is {zero:+.2f} rad off'
            remedy += f'; or {_zero_remedy(zero)}'
        return fault('lidar upside down', text, remedy)
    text = 'the whole sensor is upside down in the robot model, or on the robot'
    turned = '0 0 0' if mounting.upside_down else '3.14159 0 0'
    return fault('sensor upside down', text, f'{LAUNCH} mount_rpy:="{turned}"')


def _left(seen: Seen) -> Finding:
    distance, azimuth = seen.nearest
    side = 'left' if azimuth > 0.0 else 'right'
    degrees = abs(math.degrees(azimuth))
    text = (
        f'the nearest thing in front is {distance:.2f} m away, {degrees:.0f} deg to the {side}; '
        'if it is on the other side, the lidar is turned over'
    )
    return unknown('left and right', text, f'{LAUNCH} laser_rpy:="3.14159 0 0"')

"""What a cloud says about the mount, in words."""

import math

from nodlidar_bringup.checks.finding import fault, Finding, good, unknown
from nodlidar_bringup.checks.graph import LAUNCH
from nodlidar_bringup.checks.orientation import ALL, AS_KNOWN, Mounting, Reversed, Seen

LEAST_FLOOR = 0.06
"""Share of the points that a floor in view has at least."""

CLEARER = 1.5
"""The floor decides if one mount shows so many times as much of it as any other."""

SHARPER = 1.15
"""Walls decide if one lever arm gives so many times as many pairs as the other."""

LEAST_LEVER = 0.02
"""Lever arms below do not show in the noise of a lidar [m]."""

_JOINT = 'set invert in servo_params to the other value: positions have to rise with the beam'
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
    """Return what the floor says, if it is seen and one mount shows it best."""
    best, second = sorted(ALL, key=lambda each: -seen.floor[each])[:2]
    share = seen.floor[best]
    if share < LEAST_FLOOR or share < CLEARER * seen.floor[second]:
        return None
    if best == AS_KNOWN:
        return good('mount', f'the floor is where it should be, with {share:.0%} of the points')
    return _wrong(best, mounting)


def _of_walls(seen: Seen, mounting: Mounting) -> Finding:
    if seen.sharpness > SHARPER:
        return good('mount', f'walls are upright; the floor is not at -{mounting.height:g} m')
    if seen.sharpness * SHARPER > 1.0:
        text = 'the cloud does not show how the lidar is mounted: no floor, few upright walls'
        return unknown('mount', text, f'turn it to a room with a floor in view; {_CHECK}')
    text = (
        "walls lean: the joint's sign is wrong, or the lidar hangs below the axis and is taken "
        'for one above'
    )
    return fault('walls lean', text, f'turn the beam up by hand, torque off; {_JOINT}')


def _wrong(best: Reversed, mounting: Mounting) -> Finding:
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

"""Whether the angles of a scan agree with each other."""

from typing import Any

# Drivers differ by a step or two in angle_max; a window in degrees is rounded.
_STEPS, _SHARE = 2.0, 0.02


def angles_in_doubt(message: Any) -> str:
    """Return how angle_max of a LaserScan contradicts its beams; empty if it does not."""
    step = message.angle_increment
    span = (len(message.ranges) - 1) * step
    last = message.angle_min + span
    if not abs(message.angle_max - last) > _STEPS * abs(step) + _SHARE * abs(span):
        return ''
    return (
        f'the last beam of scans is at {last:.2f} rad by angle_min and angle_increment, but at '
        f'{message.angle_max:.2f} rad by angle_max: one of them is wrong'
    )

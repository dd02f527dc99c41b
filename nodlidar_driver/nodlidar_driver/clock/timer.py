"""The lidar's 24-bit millisecond timer without its wraps (every 4 h 39 min 37.216 s)."""

from nodlidar_common.scip import TIMER_BITS

_WRAP_MS = 1 << TIMER_BITS


def unwrapped(device_ms: int, near_ms: int) -> int:
    """Return the timer's value without wraps [ms]: the possible value nearest to another one.

    Parameters
    ----------
    device_ms
        Value that the device sent [ms], 0 <= device_ms < 2**24.
    near_ms
        An earlier or later value without wraps [ms].
    """
    return near_ms + (device_ms - near_ms + _WRAP_MS // 2) % _WRAP_MS - _WRAP_MS // 2

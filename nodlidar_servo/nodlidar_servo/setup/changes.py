"""What a servo needs so that the node can nod it; without a servo."""

from dataclasses import dataclass

from nodlidar_common.errors import ParameterError
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.models.control_table import REVERSED, TIME_BASED
from nodlidar_servo.setup.condition import Condition
from nodlidar_servo.setup.registers import rate_code, registers_of

RETURN_LEVEL = 'return level'


@dataclass(frozen=True, slots=True)
class Change:
    """A register to be written: its name, values before (None if unknown) and after, and why."""

    name: str
    before: int | None
    after: int
    reason: str


def needed_changes(condition: Condition, config: ServoConfig) -> list[Change]:
    """Return the changes, in the order in which they must be written.

    Writes are confirmed once all requests are answered. ID and bit rate are last, since the servo
    then has another address.

    Parameters
    ----------
    condition
        The servo.
    config
        What the node will ask for, with the servo's own model.

    Raises
    ------
    ParameterError
        If the servo cannot have the bit rate.
    """
    code = rate_code(condition.found.packets, config.baud_rate)
    if code is None:
        raise ParameterError('baud_rate', 'a rate that the servo can have', config.baud_rate)
    values = condition.values
    reply_to_all = registers_of(condition.found.packets).reply_to_all
    wanted = {
        RETURN_LEVEL: (reply_to_all, 'all requests are answered'),
        **_modes(condition),
        **_limits(config),
        'return delay': (0, 'replies come at once'),
        'ID': (config.servo_id, 'servo_id of the node'),
        'bit rate': (code, f'{config.baud_rate} bit/s, baud_rate of the node'),
    }
    return [
        Change(name, values[name], after, reason)
        for name, (after, reason) in wanted.items()
        if values[name] != after
    ]


def _modes(condition: Condition) -> dict[str, tuple[int, str]]:
    """Return the modes, of which a servo may have none, as one of Protocol 1.0, one or both."""
    modes, position_mode = {}, registers_of(condition.found.packets).position_mode
    if position_mode is not None:
        modes['operating mode'] = position_mode, 'position control'
    if 'drive mode' in condition.values:
        drive = condition.values['drive mode'] & ~(TIME_BASED | REVERSED)
        modes['drive mode'] = drive, 'speeds, not durations; not reversed'
    return modes


def _limits(config: ServoConfig) -> dict[str, tuple[int, str]]:
    ends = (config.pitch_lower_limit, config.pitch_upper_limit)
    low, high = sorted(config.scale.tick(pitch) for pitch in ends)
    reason = f'the mount allows {ends[0]:g} to {ends[1]:g} rad'
    return {'lower limit': (low, reason), 'upper limit': (high, reason)}

"""Prepares a servo: it answers, holds no torque, and its own limits allow those of the mount."""

from contextlib import suppress
from dataclasses import dataclass

from nodlidar_common.errors import DeviceError, ParameterError
from nodlidar_servo.bus.dynamixel_bus import DynamixelBus
from nodlidar_servo.bus.replies import (
    HARDWARE_ERRORS,
    NoAnswerError,
    RefusedError,
    status_names,
)
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.models.control_table import ControlTable
from nodlidar_servo.models.models import MODELS

_RETURN_DELAY_UNIT_NS = 2000
_SETUP = 'the command `ros2 run nodlidar_servo setup` sets it right'
_WATCHDOG = 25  # of 20 ms
LONGEST_SILENCE = 0.4
"""Time without requests [s] after which the watchdog, of 0.5 s, may have expired."""


@dataclass(frozen=True, slots=True)
class MotorLimits:
    """The motor's own limits: temperature [deg C], voltages [V], status bits that shut it down."""

    temperature: int
    voltage_min: float
    voltage_max: float
    shutdown: int


@dataclass(frozen=True, slots=True)
class Setting:
    """What was set: limits, registers, and the return delay [ns]; gain 0: it is left as it is."""

    limits: MotorLimits
    torque_limit: int
    position_gain: int
    return_delay_ns: int


def prepare(bus: DynamixelBus, config: ServoConfig) -> Setting:
    """Prepare a servo, with its torque off.

    Raises
    ------
    DeviceError
        If the servo does not answer, is another model, cannot be positioned, or its own limits
        exclude those of the mount.
    """
    table = config.scale.model.table
    found = _read(bus, table)
    _check_model(found['model number'], config)
    if found['return level'] != table.reply_to_all:
        _have_writes_confirmed(bus, table)
    shutdown = found['shutdown'] << table.alarm_shift
    _revive(bus, table, shutdown)
    bus.write(*table.encoded('torque', False))
    set_watchdog(bus, table, on=False)
    _check_positions(found, config)
    if found['return delay'] != 0:  # the EEPROM wears out
        with suppress(RefusedError):  # if it is locked, the stamps allow for the delay
            bus.write(*table.encoded('return delay', 0))
    if (most := found['most torque']) == 0:
        raise DeviceError(
            f'the maximum torque of the servo (address {table.address("most torque")}) is 0: it'
            ' cannot move'
        )
    torque_limit = round(config.torque_limit * most)
    write_torque_limit(bus, table, torque_limit)
    gain = config.position_gain or config.scale.model.position_gain
    write_position_gain(bus, table, gain)
    delay_ns = bus.read(table.address('return delay'), 1).data[0] * _RETURN_DELAY_UNIT_NS
    voltages = found['lowest voltage'] / 10.0, found['highest voltage'] / 10.0
    limits = MotorLimits(found['hottest'], *voltages, shutdown)
    return Setting(limits, torque_limit, gain, delay_ns)


def write_torque_limit(bus: DynamixelBus, table: ControlTable, limit: int) -> None:
    """Write the torque limit; Protocol 1.0: it revives a motor that has shut itself down."""
    bus.write(*table.encoded('torque limit', limit))


def write_position_gain(bus: DynamixelBus, table: ControlTable, gain: int) -> None:
    """Write the P gain of the position loop, unless it is 0 or not in RAM."""
    if gain and 'position gain' in table.registers:
        bus.write(*table.encoded('position gain', gain))


def set_watchdog(bus: DynamixelBus, table: ControlTable, *, on: bool) -> None:
    """Make the motor stop 0.5 s after the last request, if it can; or never.

    An expired watchdog refuses goals until 0 is written (ROBOTIS e-manual, Bus Watchdog).
    """
    if 'watchdog' in table.registers:
        bus.write(*table.encoded('watchdog', 0))
        if on:
            bus.write(*table.encoded('watchdog', _WATCHDOG))


def hardware_errors(bus: DynamixelBus, table: ControlTable) -> int:
    """Return the status bits of the register of alarms, 0 if the servo has no such register."""
    if 'errors' not in table.registers:
        return 0
    return bus.read(table.address('errors'), 1).data[0] << HARDWARE_ERRORS


def _read(bus: DynamixelBus, table: ControlTable) -> dict[str, int]:
    try:
        block = bus.read(0, table.set_up_size)
    except NoAnswerError:  # it may be set to answer nothing but pings
        bus.post(*table.encoded('return level', table.reply_to_all))
        block = bus.read(0, table.set_up_size)
    return table.values(block.data)


def _have_writes_confirmed(bus: DynamixelBus, table: ControlTable) -> None:
    address, data = table.encoded('return level', table.reply_to_all)
    bus.post(address, data)
    level = bus.read(address, 1).data[0]
    if level != table.reply_to_all:
        raise DeviceError(
            f'the servo confirms no writes (its status return level, address {address}, is'
            f' {level}) and is locked: switch its power off and on'
        )


def _revive(bus: DynamixelBus, table: ControlTable, shutdown: int) -> None:
    """Start a motor anew that has shut itself down, if only that revives it.

    Other alarms than those that shut it down (`shutdown`) leave it its torque, and may last.
    """
    if alarms := hardware_errors(bus, table) & shutdown:
        bus.reboot()
        raise DeviceError(
            f'the servo has shut itself down ({status_names(alarms)}); it was started anew'
        )


def _check_model(number: int, config: ServoConfig) -> None:
    if number != config.scale.model.number:
        found = next((m.name for m in MODELS.values() if m.number == number), 'unknown')
        raise DeviceError(
            f"'model' is {config.model}, but the servo with ID {config.servo_id}"
            f' has model number {number} ({found})'
        )


def _check_positions(found: dict[str, int], config: ServoConfig) -> None:
    low, high, scale = found['lower limit'], found['upper limit'], config.scale
    if wrong := scale.model.table.wrong_mode(found):
        raise DeviceError(f'the servo is {wrong}; {_SETUP}')
    if low > high:
        raise DeviceError(
            f'the lower limit of the position in the servo, {low}, is above the upper one, {high};'
            f' {_SETUP}'
        )
    for key in ('pitch_lower_limit', 'pitch_upper_limit'):
        pitch = getattr(config, key)
        if not low <= scale.tick(pitch) <= high:
            least, most = sorted((scale.pitch(low), scale.pitch(high)))
            limit = f'between {least:.4f} and {most:.4f} rad, the limits set in the servo'
            raise DeviceError(f'{ParameterError(key, limit, pitch)}; {_SETUP}')

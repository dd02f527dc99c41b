"""The registers of Feetech's STS servos: where they are, and what they mean.

By Feetech's SCServo library (SMS_STS.h) and LeRobot's tables for Feetech, which agree.
"""

import struct

from nodlidar_servo.bus.packets import PROTOCOL_STS
from nodlidar_servo.bus.replies import STS_ERRORS
from nodlidar_servo.models.control_table import ControlTable, Present, PRESENT_1, SetUp, signed

_SIGN = 0x8000  # of positions and speeds
_EEPROM = struct.Struct('<3xH2xBBHHBBBHxB13xB')  # 0..33: model number to operating mode
_DRIVE = struct.Struct('<BHHH')  # acceleration, goal, time, speed


class _TableSts(ControlTable):
    def parse_set_up(self, data: bytes) -> SetUp:
        number, delay, level, low, high, hottest, most, least, torque, shutdown, mode = (
            _EEPROM.unpack(data)
        )
        wrong = ''
        if mode:
            wrong = f'in operating mode {mode} (address 33): set it to 0, position control'
        elif low == high == 0:
            wrong = 'in multi-turn mode: set its angle limits (addresses 9 and 11)'
        voltages = least / 10.0, most / 10.0
        shutdown <<= STS_ERRORS
        return SetUp(number, delay, low, high, hottest, *voltages, torque, level, shutdown, wrong)

    def parse_present(self, data: bytes) -> Present:
        position, speed, load, voltage, temperature = PRESENT_1.unpack(data)
        return Present(
            signed(position, _SIGN),
            signed(speed, _SIGN),
            signed(load),
            voltage / 10.0,
            temperature,
        )

    def goal(self, tick: int, speed: int) -> bytes:
        return _DRIVE.pack(0, tick, 0, speed)  # 0: no limit of acceleration, no time


TABLE_STS = _TableSts(
    PROTOCOL_STS,
    return_delay=7,
    most_torque=16,
    return_level=8,
    torque_enable=40,
    torque_limit=48,
    hardware_error=None,
    watchdog=None,
    position_gain=None,
    drive=41,
    present=56,
    present_size=PRESENT_1.size,
    set_up_size=_EEPROM.size,
    most_speed=_SIGN - 1,
    reply_to_all=1,
)

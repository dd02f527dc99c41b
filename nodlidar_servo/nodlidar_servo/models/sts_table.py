"""The registers of Feetech's STS servos: where they are, and what they mean.

By Feetech's SCServo library (SMS_STS.h) and LeRobot's tables for Feetech, which agree.
"""

from collections.abc import Mapping
import struct

from nodlidar_servo.bus.packets import PROTOCOL_STS
from nodlidar_servo.bus.replies import STS_ERRORS
from nodlidar_servo.models.control_table import ControlTable, Present, PRESENT_1, signed

_SIGN = 0x8000  # of positions and speeds
_DRIVE = struct.Struct('<BHHH')  # acceleration, goal, time, speed


class _TableSts(ControlTable):
    def wrong_mode(self, values: Mapping[str, int]) -> str:
        if mode := values['operating mode']:
            return f'in operating mode {mode} (address 33): set it to 0, position control'
        if values['lower limit'] == values['upper limit'] == 0:
            return 'in multi-turn mode: set its angle limits (addresses 9 and 11)'
        return ''

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


_REGISTERS = {
    'firmware': (0, 1), 'model number': (3, 2), 'ID': (5, 1), 'bit rate': (6, 1),
    'return delay': (7, 1), 'return level': (8, 1), 'lower limit': (9, 2), 'upper limit': (11, 2),
    'hottest': (13, 1), 'highest voltage': (14, 1), 'lowest voltage': (15, 1),
    'most torque': (16, 2), 'shutdown': (19, 1), 'operating mode': (33, 1), 'torque': (40, 1),
    'torque limit': (48, 2), 'EEPROM lock': (55, 1), 'position': (56, 2), 'voltage': (62, 1),
    'temperature': (63, 1),
}  # fmt: skip
TABLE_STS = _TableSts(
    PROTOCOL_STS,
    _REGISTERS,
    set_up_size=34,
    drive=41,
    present=56,
    present_size=PRESENT_1.size,
    most_speed=_SIGN - 1,
    reply_to_all=1,
    position_mode=0,
    alarm_shift=STS_ERRORS,
)

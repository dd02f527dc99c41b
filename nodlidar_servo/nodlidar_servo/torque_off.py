"""The request that switches the torque off when the node is killed, and its confirmation."""

import re

from dynamixel_sdk import INST_WRITE
from nodlidar_common.guard import StopRequest
from nodlidar_servo.models import Register
from nodlidar_servo.replies import REFUSALS


def torque_off(servo_id: int) -> StopRequest:
    """Return the request that switches the torque off."""
    request = write_packet(servo_id, Register.TORQUE_ENABLE, bytes([False]))
    return StopRequest('servo', request, write_confirmation(servo_id))


def write_packet(servo_id: int, address: int, data: bytes) -> bytes:
    """Return the bytes of a write request of Protocol 1.0."""
    return _packet(bytes([servo_id, len(data) + 3, INST_WRITE, address, *data]))


def write_confirmation(servo_id: int) -> bytes:
    """Return the regular expression of the replies that confirm a write, with any alarm."""
    replies = (bytes([servo_id, 2, status]) for status in range(256) if not status & REFUSALS)
    return b'|'.join(re.escape(_packet(body)) for body in replies)


def _packet(body: bytes) -> bytes:
    return b'\xff\xff' + body + bytes([~sum(body) & 0xFF])

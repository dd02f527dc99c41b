"""The request that switches the torque off when the node is killed, and its confirmation."""

import re

from dynamixel_sdk import INST_WRITE
from nodlidar_common.guard import StopRequest
from nodlidar_servo.bus.packets import PacketFormat
from nodlidar_servo.models.control_table import ControlTable


def torque_off(servo_id: int, table: ControlTable) -> StopRequest:
    """Return the request that switches the torque off."""
    packets = table.packets
    request = write_packet(packets, servo_id, *table.encoded('torque', False))
    return StopRequest('servo', request, write_confirmation(packets, servo_id))


def write_packet(packets: PacketFormat, servo_id: int, address: int, data: bytes) -> bytes:
    """Return the bytes of a write request."""
    return packets.encode(servo_id, INST_WRITE, packets.number(address) + data)


def write_confirmation(packets: PacketFormat, servo_id: int) -> bytes:
    """Return the regular expression of the replies that confirm a write, with any alarm."""
    accepted = (status for status in range(256) if not packets.refusal(status))
    replies = (packets.encode_answer(servo_id, status) for status in accepted)
    return b'|'.join(re.escape(reply) for reply in replies)

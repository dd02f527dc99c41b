"""The emulated servos as the Dynamixel SDK sees them, alone and with others on a bus."""

from dynamixel_sdk import GroupSyncRead, GroupSyncWrite, PacketHandler, PortHandler
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.shared_bus import SharedBus
from nodlidar_sim.devices.x_servo import TICK, XServoEmulator
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.servo_motion import ServoMotion
import pytest

IDS = (1, 2, 5)
KINDS = {
    1.0: (RxServoEmulator, 1, 24, 30, 2, 24),  # 1 Mbit/s, torque, goal and its size, model
    2.0: (XServoEmulator, 3, 64, 116, 4, 1060),
}


def servos(version, ids=IDS):
    kind, baud, *_ = KINDS[version]
    return [kind(ServoMotion(0.1 * each), baud=baud, servo_id=each) for each in ids]


@pytest.fixture(params=[1.0, 2.0])
def version(request):
    return request.param


def test_the_sdk_uses_several_servos(version):
    *_, torque, goal, size, model = KINDS[version]
    handler = PacketHandler(version)
    read = handler.read2ByteTxRx if size == 2 else handler.read4ByteTxRx
    with PseudoTerminals({'servos': SharedBus(servos(version))}) as ports:
        port = PortHandler(ports['servos'])
        assert port.openPort()
        assert port.setBaudRate(1_000_000)
        assert [handler.ping(port, each) for each in IDS] == [(model, 0, 0)] * 3
        assert handler.write1ByteTxRx(port, 2, torque, 1) == (0, 0)
        sync = GroupSyncWrite(port, handler, goal, size)
        for each in IDS:
            sync.addParam(each, [100 + each, *[0] * (size - 1)])
        assert sync.txPacket() == 0
        assert [read(port, each, goal) for each in IDS] == [(100 + each, 0, 0) for each in IDS]
        if version == 2.0:
            assert handler.broadcastPing(port) == ({each: [1060, 45] for each in IDS}, 0)
            reading = GroupSyncRead(port, handler, 132, 4)
            for each in reversed(IDS):
                reading.addParam(each)
            assert reading.txRxPacket() == 0
            ticks = [reading.getData(each, 132, 4) for each in IDS]
            still = (ticks[0], ticks[2])  # the one with torque moves
            assert still == (2048 + round(0.1 / TICK), 2048 + round(0.5 / TICK))
        port.closePort()


def test_the_eeprom_is_locked_while_torque_is_on(version):
    _, _, torque, *_ = KINDS[version]
    [servo] = servos(version, [1])
    delay = 5 if version == 1.0 else 9
    write = servo.table.write
    assert not write(delay, b'\x07')
    write(torque, b'\x01')
    assert write(delay, b'\x08')
    write(torque, b'\x00')
    assert servo.table.read(delay, 1) == b'\x07'
    assert not write(delay, b'\x08')


def exchanged(bus, request):
    port = VirtualPort(bus, VirtualClock(10**18), timeout=1.0)
    port.write(request)
    return port.read(1000)


def test_a_new_bit_rate_holds_after_the_reply():
    [servo] = servos(2.0, [1])
    servo.host_bit_rate = 1_000_000
    request = bytes.fromhex('FFFFFD00 01 0600 03 0800 01')  # bit rate: 57600
    handler = PacketHandler(2.0)
    crc = handler.updateCRC(0, list(request), len(request)).to_bytes(2, 'little')
    assert exchanged(servo, request + crc) == bytes.fromhex('FFFFFD00 01 0400 55 00 A10C')
    assert servo.bit_rate == 57_600
    ping = bytes.fromhex('FFFFFD00 01 0300 01 194E')
    assert exchanged(servo, ping) == b''
    servo.host_bit_rate = 57_600
    assert len(exchanged(servo, ping)) == 14


def at(*pitches):
    return [XServoEmulator(ServoMotion(pitch), baud=3) for pitch in pitches]


def test_replies_of_one_id_break_each_other():
    request = bytes.fromhex('FFFFFD00 01 0700 02 84000400 1D15')  # position, of the e-manual
    first, second = (exchanged(each, request) for each in at(0.1, -0.3))
    both = exchanged(SharedBus(at(0.1, -0.3)), request)
    assert both == bytes(a & b for a, b in zip(first, second, strict=True))
    assert both not in (first, second)
    assert exchanged(SharedBus(at(0.1, 0.1)), request) == first  # cannot be seen

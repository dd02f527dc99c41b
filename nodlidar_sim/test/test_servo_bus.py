"""The emulated servos as the Dynamixel SDK sees them, alone and with others on a bus."""

from dynamixel_sdk import GroupSyncRead, GroupSyncWrite, PacketHandler, port_handler, PortHandler
from nodlidar_sim.devices.servo_models import EMULATED
from nodlidar_sim.devices.shared_bus import SharedBus
from nodlidar_sim.devices.x_servo import TICK, XServoEmulator
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.ideal_servo import IdealServo
import pytest

IDS = (1, 2, 5)
TORQUE, GOAL, GOAL_SIZE = {1.0: 24, 2.0: 64}, {1.0: 30, 2.0: 116}, {1.0: 2, 2.0: 4}
# Of every Dynamixel, by its page of the e-manual: protocol, model number, and by address the
# limits of temperature, voltage and torque; last the voltage of the data sheet's torque.
SERVOS = {
    'RX-24F': (1.0, 24, {11: 80, 12: 60, 13: 190, 14: 1023, 34: 1023, 42: 120}),
    'RX-28': (1.0, 28, {11: 80, 12: 60, 13: 190, 14: 1023, 34: 1023, 42: 185}),
    'RX-64': (1.0, 64, {11: 80, 12: 60, 13: 190, 14: 1023, 34: 1023, 42: 185}),
    'AX-12A': (1.0, 12, {11: 70, 12: 60, 13: 140, 14: 1023, 34: 1023, 42: 120}),
    'AX-18A': (1.0, 18, {11: 75, 12: 60, 13: 140, 14: 983, 34: 983, 42: 120}),
    'MX-28': (1.0, 29, {11: 80, 12: 60, 13: 160, 14: 1023, 34: 1023, 42: 120}),
    'MX-28-2': (2.0, 30, {31: 80, 32: 160, 34: 95, 36: 885, 100: 885, 144: 120}),
    'XL430-W250': (2.0, 1060, {31: 72, 32: 140, 34: 60, 36: 885, 100: 885, 144: 120}),
    'XL330-M288': (2.0, 1200, {31: 70, 32: 70, 34: 35, 36: 885, 100: 885, 144: 50}),
    'XL330-M077': (2.0, 1190, {31: 70, 32: 70, 34: 35, 36: 885, 100: 885, 144: 50}),
}
OF_ONE_BYTE = {11, 12, 13, 31, 42}


def servos(name, ids=IDS):
    kind = EMULATED[name]
    return [
        kind.emulator(IdealServo(0.1 * each), baud=kind.megabit, servo_id=each) for each in ids
    ]


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """By default, the SDK waits 34 ms for a reply, for which a busy host may be too slow."""
    monkeypatch.setattr(port_handler, 'LATENCY_TIMER', 1000)


@pytest.fixture(params=SERVOS)
def name(request):
    return request.param


def test_every_emulated_dynamixel_is_tested_here():
    assert set(SERVOS) == set(EMULATED) - {'STS3215'}


def test_the_sdk_uses_several_servos(name):
    version, model, values = SERVOS[name]
    torque, goal, size = TORQUE[version], GOAL[version], GOAL_SIZE[version]
    handler = PacketHandler(version)
    read = handler.read2ByteTxRx if size == 2 else handler.read4ByteTxRx
    with PseudoTerminals({'servos': SharedBus(servos(name))}) as ports:
        port = PortHandler(ports['servos'])
        assert port.openPort()
        assert port.setBaudRate(1_000_000)
        assert [handler.ping(port, each) for each in IDS] == [(model, 0, 0)] * 3
        for address, value in values.items():
            short = address in OF_ONE_BYTE
            limit = (handler.read1ByteTxRx if short else handler.read2ByteTxRx)(port, 2, address)
            assert limit == (value, 0, 0), address
        assert handler.write1ByteTxRx(port, 2, torque, 1) == (0, 0)
        sync = GroupSyncWrite(port, handler, goal, size)
        for each in IDS:
            sync.addParam(each, [100 + each, *[0] * (size - 1)])
        assert sync.txPacket() == 0
        assert [read(port, each, goal) for each in IDS] == [(100 + each, 0, 0) for each in IDS]
        if version == 2.0:
            assert handler.broadcastPing(port) == ({each: [model, 45] for each in IDS}, 0)
            reading = GroupSyncRead(port, handler, 132, 4)
            for each in reversed(IDS):
                reading.addParam(each)
            assert reading.txRxPacket() == 0
            ticks = [reading.getData(each, 132, 4) for each in IDS]
            still = (ticks[0], ticks[2])  # the one with torque moves
            assert still == (2048 + round(0.1 / TICK), 2048 + round(0.5 / TICK))
        port.closePort()


def test_the_bit_rate_of_the_factory_is_that_of_the_e_manual(name):
    kind = EMULATED[name]
    fast = name.startswith('AX')
    assert kind.emulator(IdealServo()).bit_rate == pytest.approx(1e6 if fast else 57_600, rel=0.01)


def test_the_eeprom_is_locked_while_torque_is_on(name):
    version, *_ = SERVOS[name]
    torque = TORQUE[version]
    [servo] = servos(name, [1])
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
    [servo] = servos('XL430-W250', [1])
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
    return [XServoEmulator(IdealServo(pitch), baud=3) for pitch in pitches]


def test_replies_of_one_id_break_each_other():
    request = bytes.fromhex('FFFFFD00 01 0700 02 84000400 1D15')  # position, of the e-manual
    first, second = (exchanged(each, request) for each in at(0.1, -0.3))
    both = exchanged(SharedBus(at(0.1, -0.3)), request)
    assert both == bytes(a & b for a, b in zip(first, second, strict=True))
    assert both not in (first, second)
    assert exchanged(SharedBus(at(0.1, 0.1)), request) == first  # cannot be seen

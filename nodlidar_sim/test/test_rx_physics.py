"""The emulated RX-24F with a servo by physics: what its registers do."""

from dataclasses import replace

from nodlidar_sim.devices.make_devices import make_devices
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import pytest
from test_rx_servo import Bus

RX24F = replace(load_servo('rx24f'), encoder_noise=0.0, encoder_nonlinearity=0.0)
HEAVY = replace(RX24F, load_mass=1.0)  # 0.78 Nm, held level
TORQUE_ON, SLOPE_CW, SLOPE_CCW, MARGIN_CW, MARGIN_CCW = 24, 28, 29, 26, 27
GOAL, SPEED, TORQUE_LIMIT, POSITION, PRESENT_SPEED, LOAD, PUNCH = 30, 32, 34, 36, 38, 40, 48


class PhysicalBus(Bus):
    """A host of a servo by physics."""

    def __init__(self, parameters=RX24F, position=0.0, **options):
        super().__init__(motion=PhysicalServo(parameters, position), **options)

    def go(self, tick, wait=1.5):
        self.write_word(GOAL, tick)
        self.wait(wait)
        return self.read(POSITION, 2)


@pytest.mark.parametrize('invert', [False, True])
def test_a_goal_is_reached_within_margin_and_friction(invert):
    bus = PhysicalBus(invert=invert)
    assert abs(bus.go(612) - 612) <= 5
    assert abs(bus.go(452) - 452) <= 5


@pytest.mark.parametrize('invert', [False, True])
def test_the_slope_of_either_direction_sets_how_far_the_weight_bends(invert):
    def bent(slope, other):
        bus = PhysicalBus(HEAVY, invert=invert)
        bus.write(SLOPE_CW, slope, other)
        assert bus.read(SLOPE_CCW) == other
        return bus.go(712, 3.0) - 712

    # Beyond the upright the weight pulls on: the motor holds back with clockwise torque.
    soft, hard = bent(128, 32), bent(32, 128)
    torque = 9.81 * 0.08 * 0.86  # about 1 rad from the upright
    assert soft == pytest.approx(128 * torque / RX24F.standstill_torque, abs=12)
    assert hard == pytest.approx(32 * torque / RX24F.standstill_torque, abs=5)


def test_within_the_margin_the_motor_does_nothing():
    bus = PhysicalBus()
    bus.write(MARGIN_CW, 60, 60)
    assert bus.read(MARGIN_CCW) == 60
    assert bus.go(562) == 512
    assert bus.go(602) > 520


def test_the_punch_overcomes_friction():
    sticky = replace(RX24F, friction_coulomb=0.4)
    weak, strong = PhysicalBus(sticky), PhysicalBus(sticky)
    for bus, punch in ((weak, 0), (strong, 300)):
        bus.write(SLOPE_CW, 254, 254)
        bus.write_word(PUNCH, punch)
    assert weak.go(540) == 512  # 28 ticks of 254 are 0.29 Nm
    assert strong.go(540) > 530


def test_the_torque_limit_decides_what_is_lifted():
    fallen = PhysicalBus(HEAVY, position=1.0)
    fallen.write_word(TORQUE_LIMIT, 250)  # 0.64 Nm of the weight's 0.66 and friction
    assert fallen.go(512, 3.0) > 690
    fallen.write_word(TORQUE_LIMIT, 1023)
    assert abs(fallen.go(512, 3.0) - 512) <= 5


def test_the_moving_speed_limits_the_speed():
    bus = PhysicalBus()
    bus.write_word(SPEED, 100)
    bus.write_word(GOAL, 812)
    bus.wait(1.0)
    counts = bus.read(PRESENT_SPEED, 2)
    assert counts & 0x3FF == pytest.approx(100, abs=5)
    bus.write_word(SPEED, 0)  # as fast as possible
    bus.write_word(GOAL, 212)
    bus.wait(0.2)
    assert bus.read(PRESENT_SPEED, 2) & 0x3FF > 600


@pytest.mark.parametrize('side', [1, -1])
def test_the_load_is_the_torque_that_holds_the_weight(side):
    bus = PhysicalBus(replace(HEAVY, friction_load=0.0, stribeck_load=0.0, backlash=0.0))
    tick = bus.go(512 + side * 100, 4.0)
    load = bus.read(LOAD, 2)
    assert bool(load & 0x400) == (side > 0)  # against the weight, which pulls on
    angle = abs(tick - 512) * RX24F.tick
    torque = 9.81 * 0.08 * angle * (1.0 - angle**2 / 6.0)
    share = (load & 0x3FF) / 1023 * RX24F.standstill_torque
    friction = RX24F.friction_coulomb + RX24F.stribeck_coulomb
    assert share == pytest.approx(torque, abs=friction + 0.02)


def test_torque_off_lets_the_lidar_fall_to_its_stop():
    bus = PhysicalBus(HEAVY)
    bus.go(600)
    bus.write(TORQUE_ON, 0)
    bus.wait(5.0)
    assert bus.read(POSITION, 2) == round(512 + RX24F.stop / RX24F.tick)


def test_a_scene_with_a_servo_gives_the_emulator_one():
    scene = replace(load_scene('wall', ideal=True), servo=RX24F)
    for chosen, kind in ((scene, 'PhysicalServo'), (replace(scene, servo=None), 'IdealServo')):
        servo = make_devices(chosen, 0, 1)['servo']
        assert type(servo.motor._motion).__name__ == kind

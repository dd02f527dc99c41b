"""The servo models that are emulated: their bytes and their physics."""

from dataclasses import replace
from functools import partial
import math
from typing import Any, NamedTuple

from nodlidar_sim.devices.bus_servo import BusServo
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.rx_table import MX28
from nodlidar_sim.devices.sts_servo import StsEmulator
from nodlidar_sim.devices.x_servo import XServoEmulator
from nodlidar_sim.world.motion import ServoShaft
from nodlidar_sim.world.scene import Scene
from nodlidar_sim.world.servo_section import load_servo

# Speeds without load, of the MX-28 at 12 V and the XL330 at 5 V (e-manual) [rad/s].
_MX28_SPEED, _XL330_SPEED = 55.0 * math.tau / 60.0, 103.0 * math.tau / 60.0
_XL330 = partial(
    XServoEmulator,
    model=1200,
    fastest=_XL330_SPEED,
    supply=5.0,
    voltages=(35, 70),
    load_unit=1750,
)


class EmulatedServo(NamedTuple):
    """One model: its emulator, the register of 1 Mbit/s, and its set of physical parameters."""

    emulator: Any
    megabit: int
    parameters: str


EMULATED = {
    'RX-24F': EmulatedServo(RxServoEmulator, 1, 'rx24f'),
    'XL430-W250': EmulatedServo(XServoEmulator, 3, 'xl430'),
    'MX-28': EmulatedServo(partial(RxServoEmulator, kind=MX28), 1, 'mx28'),
    'MX-28-2': EmulatedServo(partial(XServoEmulator, model=30, fastest=_MX28_SPEED), 3, 'mx28'),
    'XL330-M288': EmulatedServo(_XL330, 3, 'xl330'),
    'STS3215': EmulatedServo(StsEmulator, 0, 'sts3215'),
}


def with_servo(scene: Scene, model: str) -> Scene:
    """Return a scene with the physics of a model, unless its servo is ideal."""
    if scene.servo is None:
        return scene
    return replace(scene, servo=load_servo(EMULATED[model].parameters))


def make_emulator(model: str, motion: ServoShaft, latency_timer: float) -> BusServo:
    """Return the emulator of a model at 1 Mbit/s, with the latency timer of its adapter [s]."""
    kind = EMULATED[model]
    emulator: BusServo = kind.emulator(motion, baud=kind.megabit, latency_timer=latency_timer)
    return emulator

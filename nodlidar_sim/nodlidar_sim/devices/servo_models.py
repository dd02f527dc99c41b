"""The servo models that are emulated: their bytes and their physics."""

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from nodlidar_sim.devices.bus_servo import BusServo
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.rx_table import AX12A, AX18A, MX28, RX24F, RX28, RX64, RxKind
from nodlidar_sim.devices.sts_servo import StsEmulator
from nodlidar_sim.devices.x_servo import XServoEmulator
from nodlidar_sim.devices.x_table import MX28_2, XKind, XL330_M077, XL330_M288, XL430
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.nod_motion import ServoShaft
from nodlidar_sim.world.scene import Scene


class EmulatedServo(NamedTuple):
    """One model: its emulator, the register of 1 Mbit/s, and its set of physical parameters."""

    emulator: Any
    megabit: int
    parameters: str


def _rx(kind: RxKind, parameters: str) -> EmulatedServo:
    return EmulatedServo(partial(RxServoEmulator, kind=kind), 1, parameters)


def _x(kind: XKind, parameters: str) -> EmulatedServo:
    return EmulatedServo(partial(XServoEmulator, kind=kind), 3, parameters)


EMULATED = {
    'RX-24F': _rx(RX24F, 'rx24f'),
    'RX-28': _rx(RX28, 'rx28'),
    'RX-64': _rx(RX64, 'rx64'),
    'AX-12A': _rx(AX12A, 'ax12a'),
    'AX-18A': _rx(AX18A, 'ax18a'),
    'MX-28': _rx(MX28, 'mx28'),
    'MX-28-2': _x(MX28_2, 'mx28'),
    'XL430-W250': _x(XL430, 'xl430'),
    'XL330-M288': _x(XL330_M288, 'xl330'),
    'XL330-M077': _x(XL330_M077, 'xl330_m077'),
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

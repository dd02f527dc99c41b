"""Emulated devices in the room, which nodes of other processes use as they would real ones."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
import sys

from nodlidar_sim.devices.device import Device
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.world.scene import load_scene, Scene

_RANGE_NOISE = 0.002  # [m]; makes every scan different, also where nothing moves
_SWITCH_INTERVAL = 2e-4  # of Python's threads [s]: no device waits for the other


def noisy_room() -> Scene:
    """Return the room for ideal devices whose ranges have noise."""
    room = load_scene('room', ideal=True)
    return replace(room, effects=replace(room.effects, range_noise=_RANGE_NOISE))


def terminals(devices: Mapping[str, Device], folder: Path) -> dict[str, PseudoTerminals]:
    """Return the ports of devices, each at a link of its name in a folder.

    A thread serves each: a servo answers in time also while a scan is being simulated.
    """
    return {
        name: PseudoTerminals({name: device}, {name: folder / name})
        for name, device in devices.items()
    }


@contextmanager
def switching_soon() -> Iterator[None]:
    """Let Python's threads take turns so soon that all devices answer in time."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_INTERVAL)
    try:
        yield
    finally:
        sys.setswitchinterval(before)

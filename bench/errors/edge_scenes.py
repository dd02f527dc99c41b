"""Scenes with edges: those of nodlidar_sim, and furnished rooms at random."""

from nodlidar_common.arrays import Array
from nodlidar_sim.world.scene import load_scene, parse_scene, Scene
import numpy as np

from bench.errors.shapes import box, plane

SHIPPED = ('room', 'corner', 'corridor', 'crossing')
_KEEP_CLEAR = 1.0  # around the sensor [m]


def drawn_room(seed: int) -> Scene:
    """Return a room of random size with boxes, cylinders and balls that stand or hang in it.

    Their brightness is random too, from black rubber to white paint.
    """
    rng = np.random.default_rng(seed)
    half = rng.uniform(1.6, 3.2, 2)
    sides = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
    planes = [plane((x * half[0], y * half[1], 1.0), (x, y, 0.0)) for x, y in sides]
    planes += [plane((0.0, 0.0, height), (0.0, 0.0, 1.0)) for height in (0.0, 2.5)]
    things = [_thing(rng, half) for _ in range(rng.integers(6, 14))]
    objects = [f'  room: {{shapes: [{", ".join(planes)}]}}']
    objects += [
        f'  thing{number}: {{shapes: [{shape}], brightness: {rng.uniform(0.1, 0.95):.3f}}}'
        for number, shape in enumerate(things)
    ]
    return parse_scene('objects:\n' + '\n'.join(objects), f'drawn {seed}')


def shipped_scenes() -> list[Scene]:
    """Return the shipped scenes with edges, without errors."""
    return [load_scene(name, ideal=True) for name in SHIPPED]


def _thing(rng: np.random.Generator, half: Array) -> str:
    """Return a shape of random kind, size and pose."""
    pose = _pose(rng, half)
    kind = rng.choice(['box', 'cylinder', 'sphere'], p=[0.6, 0.3, 0.1])
    if kind == 'box':
        return box(pose, _rounded(rng.uniform(0.05, 0.7, 3)))
    if kind == 'cylinder':
        radius, length = _rounded(rng.uniform([0.02, 0.3], [0.2, 1.8]))
        return f'{{cylinder: {{pose: {pose}, radius: {radius}, length: {length}}}}}'
    return f'{{sphere: {{center: {pose[:3]}, radius: {rng.uniform(0.05, 0.3):.3f}}}}}'


def _pose(rng: np.random.Generator, half: Array) -> list[float]:
    """Return x y z roll pitch yaw in the room, away from the sensor; nearly upright."""
    place = rng.uniform(-half, half)
    while np.hypot(*place) < _KEEP_CLEAR:
        place = rng.uniform(-half, half)
    turn = rng.normal(0.0, [0.3, 0.3, 3.0])
    return _rounded(np.concatenate([place, rng.uniform(0.2, 2.0, 1), turn]))


def _rounded(values: Array) -> list[float]:
    return [float(value) for value in np.round(values, 3)]

"""Maps of buildings drawn at random: how far path and map are off.

Rings of corridors with doors, rooms and furniture, with right angles or crooked ones, and halls
that are wider than the lidar sees. Devices and odometry have the errors of the drives in
`mapping`, and paths are aligned as there.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

from nodlidar_common.arrays import Array
from nodlidar_sim.world.route import Leg
from nodlidar_sim.world.scene import parse_scene, Scene
import numpy as np
import yaml

from bench.maps.drives import ODOMETRY, recorded
from bench.maps.mapping import errors_of, Mapped, mapped
from bench.shared.report import Row

Walls = list[tuple[Array, Array]]  # from, to
Things = list[dict[str, object]]  # shapes of a scene

TITLE = 'Maps of buildings drawn at random, worst of the seeds; errors as a share of the path'
SEEDS = range(1, 5)
SPEEDS = (0.6, 1.2)  # m/s
RADIUS = 0.75  # of turns [m]
LAPS = 1.4  # of the way around
HALF_WIDTH = 1.0  # of a corridor [m]
HEIGHT, THICKNESS = 2.5, 0.1  # of walls [m]
DOOR = 1.0  # width [m]


def ring(rng: np.random.Generator) -> tuple[Array, Walls, Things]:
    """Return corners, walls and furniture of a rectangular ring of corridors."""
    a, b = rng.uniform(11.0, 20.0, 2)
    return _ring(rng, np.array([(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)]))


def crooked_ring(rng: np.random.Generator) -> tuple[Array, Walls, Things]:
    """Return corners, walls and furniture of a ring of five corridors at crooked angles."""
    angle = 2.0 * np.pi * (np.arange(5) + rng.uniform(-0.2, 0.2, 5)) / 5.0
    half = rng.uniform(8.0, 12.0, 2)
    return _ring(rng, half * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def hall(rng: np.random.Generator) -> tuple[Array, Walls, Things]:
    """Return corners of the way, walls and furniture of a hall."""
    size = rng.uniform((14.0, 12.0), (22.0, 18.0))
    unit = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    corners = size * unit
    way = corners + rng.uniform(2.5, 4.0, (4, 2)) * (1.0 - 2.0 * unit)
    walls = list(pairwise([*corners, corners[0]]))
    places = rng.uniform(0.5, size - 0.5, (80, 2))
    away = [place for place in places if _distance(place, way) > 1.2]
    return way, walls, [thing(rng, place) for place in away]


KINDS: dict[str, Callable[..., tuple[Array, Walls, Things]]] = {
    'ring': ring,
    'hall': hall,
    'crooked ring': crooked_ring,
}


def drawn(kind: str, seed: int, speed: float) -> Scene:
    """Return a building with a drive around it, LAPS times."""
    corners, walls, things = KINDS[kind](np.random.default_rng(seed))
    start, legs = _drive(corners, speed)
    scene = built([box(*wall) for wall in walls], things, f'{kind} {seed}')
    return replace(scene, base_start=start, base_legs=legs)


def built(walls: Things, things: Things, name: str) -> Scene:
    """Return a scene with a floor and a ceiling, and with the devices of the drives."""
    planes = [
        {'plane': {'point': [0.0, 0.0, z], 'normal': [0.0, 0.0, up]}}
        for z, up in ((0.0, 1.0), (HEIGHT, -1.0))
    ]
    content = {
        'lidar': {'model': 'urg_04lx_ug01'},
        'servo': {'model': 'rx24f'},
        'effects': ODOMETRY,
        'objects': {
            'floor_and_ceiling': {'shapes': planes},
            'walls': {'shapes': walls},
            'furniture': {'brightness': 0.4, 'shapes': things},
        },
    }
    return parse_scene(yaml.safe_dump(content), name)


def results() -> list[Row]:
    """Return the errors of each kind of building at each speed."""
    return [
        {
            'building': kind,
            'speed [m/s]': speed,
            **errors_of([_run(drawn(kind, seed, speed), seed) for seed in SEEDS]),
        }
        for kind in KINDS
        for speed in SPEEDS
    ]


def _run(scene: Scene, seed: int) -> Mapped:
    return mapped(recorded(scene, sum(leg.duration for leg in scene.base_legs), seed))


def _drive(corners: Array, speed: float) -> tuple[tuple[float, float, float], tuple[Leg, ...]]:
    """Return start and legs of a drive around convex corners, counted to the left."""
    sides = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(sides, axis=1)
    yaw = np.arctan2(sides[:, 1], sides[:, 0])
    turn = np.mod(np.roll(yaw, -1) - yaw, 2.0 * np.pi)  # at the end of each side
    cut = RADIUS * np.tan(turn / 2.0)
    straight = length - cut - np.roll(cut, 1)
    legs: list[Leg] = []
    for i in range(round(LAPS * len(corners))):
        k = i % len(corners)
        legs.append(Leg(float(straight[k]) / speed, (speed, 0.0)))
        legs.append(Leg(float(turn[k]) * RADIUS / speed, (speed, speed / RADIUS)))
    x, y = corners[0] + cut[-1] * sides[0] / length[0]
    return (float(x), float(y), float(yaw[0])), tuple(legs)


def _ring(rng: np.random.Generator, corners: Array) -> tuple[Array, Walls, Things]:
    walls: Walls = []
    things: Things = []
    for outside in (1.0, -1.0):
        line = _widened(corners, outside * HALF_WIDTH)
        for start, end in pairwise([*line, line[0]]):
            more_walls, more_things = _side(rng, start, end, outside)
            walls += more_walls
            things += more_things
    return corners, walls, things


def _widened(corners: Array, distance: float) -> Array:
    """Return the corners of a convex polygon with its sides moved outwards."""
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    before = np.roll(normals, 1, axis=0)
    along = 1.0 + np.einsum('ni,ni->n', normals, before)
    return np.asarray(corners + distance * (normals + before) / along[:, None])


def _side(
    rng: np.random.Generator, start: Array, end: Array, outside: float
) -> tuple[Walls, Things]:
    """Return a wall with doors, the rooms behind them, and what stands along it."""
    length = float(np.linalg.norm(end - start))
    ahead = (end - start) / length
    away = outside * np.array([ahead[1], -ahead[0]])  # from the corridor

    def at(along: float, off: float) -> Array:
        return np.asarray(start + along * ahead + off * away)

    walls: Walls = []
    things: Things = []
    begin, door = 0.0, float(rng.uniform(2.5, 6.0))
    while door + DOOR < length - 2.5:
        walls.append((at(begin, 0.0), at(door, 0.0)))
        begin = door + DOOR
        depth = 0.2 if rng.random() < 0.4 else float(rng.uniform(1.5, 2.5))  # closed or open
        left, right = door, begin
        if depth > 1.0:
            left, right = door - rng.uniform(0.3, 1.2), begin + rng.uniform(0.3, 1.2)
            things.append(thing(rng, at(rng.uniform(left, right), depth - 0.3)))
        outline = [(left, 0.1), (left, depth), (right, depth), (right, 0.1)]
        walls += pairwise([at(*place) for place in outline])
        if rng.random() < 0.5:
            things.append(thing(rng, at(begin + 0.6, -0.1)))
        door = begin + float(rng.uniform(3.0, 7.0))
    walls.append((at(begin, 0.0), at(length, 0.0)))
    return walls, things


def thing(rng: np.random.Generator, place: Array) -> dict[str, object]:
    """Return a cupboard, a table or a pillar."""
    x, y = (round(float(value), 3) for value in place)
    height = round(float(rng.uniform(0.5, 2.2)), 3)
    pose = [x, y, height / 2.0, 0.0, 0.0, round(float(rng.uniform(0.0, 3.0)), 3)]
    if rng.random() < 0.3:
        radius = round(float(rng.uniform(0.1, 0.25)), 3)
        return {'cylinder': {'pose': pose, 'radius': radius, 'length': height}}
    size = [round(float(value), 3) for value in rng.uniform(0.3, 0.6, 2)]
    return {'box': {'pose': pose, 'size': [*size, height]}}


def box(start: Array, end: Array) -> dict[str, object]:
    """Return a wall."""
    x, y = (float(value) for value in (start + end) / 2.0)
    across, up = (float(value) for value in end - start)
    length = float(np.hypot(across, up)) + THICKNESS
    pose = [x, y, HEIGHT / 2.0, 0.0, 0.0, float(np.arctan2(up, across))]
    return {'box': {'pose': pose, 'size': [length, THICKNESS, HEIGHT]}}


def _distance(place: Array, corners: Array) -> float:
    """Return the distance of a place from the sides of a polygon [m]."""
    sides = np.roll(corners, -1, axis=0) - corners
    share = np.einsum('ni,ni->n', place - corners, sides) / np.einsum('ni,ni->n', sides, sides)
    nearest = corners + np.clip(share, 0.0, 1.0)[:, None] * sides
    return float(np.linalg.norm(place - nearest, axis=1).min())

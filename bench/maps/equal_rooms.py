"""A house of equal rooms on both sides of a corridor: what is in them tells them apart."""

from dataclasses import replace
from itertools import pairwise

from nodlidar_common.arrays import Array
from nodlidar_sim.world.route import Leg
from nodlidar_sim.world.scene import Scene
import numpy as np

from bench.maps.drawn_buildings import box, built, DOOR, thing, Things, Walls

ROOMS = 4  # on each side
WIDTH, DEPTH = 3.6, 3.2  # of a room [m]
HALF_WIDTH = 0.9  # of the corridor [m]
DOOR_AT = 1.3  # in each room [m]
THINGS = 2  # in each room, besides the bed
INTO = 1.2  # m, how far the robot drives into a room
TURN_RATE = 0.8  # rad/s


def equal_rooms(seed: int, speed: float, furniture: int = 0) -> Scene:
    """Return a house with a drive along the corridor and into each room, in random order.

    Parameters
    ----------
    seed
        Of the order of the rooms, and of what is in them.
    speed
        Of the drive [m/s].
    furniture
        Another one puts the same house other things, with the same beds.
    """
    things_rng = np.random.default_rng([seed, furniture])
    walls: Walls = [_wall((0.0, -HALF_WIDTH), (0.0, HALF_WIDTH))]
    walls.append(_wall((ROOMS * WIDTH, -HALF_WIDTH), (ROOMS * WIDTH, HALF_WIDTH)))
    things: Things = []
    doors: list[tuple[float, float]] = []
    for side in (1.0, -1.0):
        near, far = side * HALF_WIDTH, side * (HALF_WIDTH + DEPTH)
        for left in (WIDTH * np.arange(ROOMS)).tolist():
            door, right = left + DOOR_AT, left + WIDTH
            walls.append(_wall((left, near), (door, near)))
            outline = ((door + DOOR, near), (right, near), (right, far), (left, far), (left, near))
            walls += [_wall(*each) for each in pairwise(outline)]
            doors.append((door + DOOR / 2.0, side))
            bed = [left + 0.75, far - 1.1 * side, 0.25, 0.0, 0.0, 0.0]
            things.append({'box': {'pose': bed, 'size': [1.2, 2.0, 0.5]}})
            for _ in range(THINGS):
                x = right - things_rng.uniform(0.35, 0.9)
                y = near + side * things_rng.uniform(0.4, DEPTH - 0.4)
                things.append(thing(things_rng, np.array([x, y])))
    way = [(0.3, 0.0)]
    for i in np.random.default_rng(seed).permutation(len(doors)):
        x, side = doors[i]
        way += [(x, 0.0), (x, side * (HALF_WIDTH + INTO)), (x, 0.0)]
    scene = built([box(*wall) for wall in walls], things, f'equal rooms {seed}')
    return _driven(scene, np.array(way), speed)


def _wall(start: tuple[float, float], end: tuple[float, float]) -> tuple[Array, Array]:
    return np.array(start), np.array(end)


def _driven(scene: Scene, way: Array, speed: float) -> Scene:
    """Return a scene with a drive straight from place to place (n, 2), turning on the spot."""
    steps = np.diff(way, axis=0)
    steps = steps[np.hypot(*steps.T) > 0.0]
    yaw = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.angle(np.exp(1j * np.diff(yaw, prepend=yaw[0])))
    legs: list[Leg] = []
    for turn, length in zip(turns.tolist(), np.hypot(*steps.T).tolist(), strict=True):
        if turn:
            legs.append(Leg(abs(turn) / TURN_RATE, (0.0, float(np.copysign(TURN_RATE, turn)))))
        legs.append(Leg(length / speed, (speed, 0.0)))
    x, y = way[0].tolist()
    return replace(scene, base_start=(x, y, float(yaw[0])), base_legs=tuple(legs))

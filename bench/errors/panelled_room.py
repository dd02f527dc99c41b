"""Rooms at random whose walls and floor are not flat: with panels, a carpet and some furniture."""

from nodlidar_sim.world.scene import parse_scene, Scene
import numpy as np

from bench.errors.shapes import box, plane

HEIGHT = 2.6  # of the room [m]
LEVEL = 0.0, 0.0, 0.0  # roll, pitch, yaw [rad]


def panelled_room(rng: np.random.Generator) -> Scene:
    """Return a room around the origin with two to five panels, a carpet and two cupboards.

    Panels stand out by 5 to 40 mm, the carpet by 4 to 20 mm.
    """
    front, left = rng.uniform(1.7, 3.2, 2)
    back, right = rng.uniform(1.7, 3.2, 2)
    walls = [  # a point, and the normal into the room
        ((front, 0.0), (-1.0, 0.0)),
        ((-back, 0.0), (1.0, 0.0)),
        ((0.0, left), (0.0, -1.0)),
        ((0.0, -right), (0.0, 1.0)),
    ]
    planes = [plane((x, y, 0.0), (*normal, 0.0)) for (x, y), normal in walls]
    planes += [plane((0.0, 0.0, z), (0.0, 0.0, 1.0)) for z in (0.0, HEIGHT)]
    objects = [f'  room: {{shapes: [{", ".join(planes)}]}}']
    for number in range(rng.integers(2, 6)):
        (x, y), (across, _) = walls[rng.integers(4)]
        along, out = rng.uniform(-1.0, 1.0), rng.uniform(0.005, 0.04)
        size = [2.0 * out, rng.uniform(0.5, 2.0)][:: 1 if across else -1]
        place = [x, along] if across else [along, y]
        panel = box([*place, rng.uniform(0.4, 2.0), *LEVEL], [*size, rng.uniform(0.3, 1.8)])
        objects.append(
            f'  panel{number}: {{shapes: [{panel}], brightness: {rng.uniform(0.3, 0.9)}}}'
        )
    place = [*rng.uniform(-1.0, 1.0, 2), 0.0, 0.0, 0.0, rng.uniform(0.0, np.pi)]
    carpet = box(place, [1.6, 1.1, rng.uniform(0.008, 0.04)])
    cupboards = [
        box([front - 0.3, 0.4 - right, 1.0, 0.0, 0.0, 0.5], [0.5, 0.9, 2.0]),
        box([0.2 - back, left - 0.6, 0.5, *LEVEL], [0.5, 0.9, 1.0]),
    ]
    objects.append(f'  carpet: {{shapes: [{carpet}]}}')
    objects.append(f'  cupboards: {{shapes: [{", ".join(cupboards)}], brightness: 0.8}}')
    return parse_scene(
        'lidar: {model: urg_04lx_ug01}\nobjects:\n' + '\n'.join(objects), 'panelled'
    )

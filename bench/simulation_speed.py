"""How much faster than real time the simulator's fast mode is, by scene."""

import time

from nodlidar_sim.scene import load_scene, scene_names
from nodlidar_sim.simulation import simulate
from rich.table import Table

from bench.reference import reference_nod, START_NS

DURATION = 20.0


def table() -> Table:
    """Return the speed of each shipped scene."""
    result = Table(title=f'Fast mode: {DURATION:.0f} s of scans')
    result.add_column('scene')
    result.add_column('times real time', justify='right')
    for name in scene_names():
        scene = load_scene(name)
        begin = time.perf_counter()
        simulate(scene, reference_nod(), DURATION, start_ns=START_NS)
        result.add_row(name, f'{DURATION / (time.perf_counter() - begin):.0f}')
    return result

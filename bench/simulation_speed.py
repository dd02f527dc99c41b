"""How much faster than real time the simulator's fast mode is, by scene, without and with effects.

Times are of one core, the lower quartile of runs that take turns.
"""

from collections.abc import Callable
from dataclasses import replace

from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.scene import load_scene, Scene, scene_names

from bench.effects import TYPICAL
from bench.hot_paths import interleaved
from bench.reference import reference_nod, START_NS
from bench.report import Row

DURATION = 20.0
ROUNDS = 15
TITLE = f'Fast mode: {DURATION:.0f} s of scans, without effects and with all of them'


def results() -> list[Row]:
    """Return the speed of each shipped scene, and of the room with all that there is."""
    chosen = scenes()
    without = speeds({n: replace(s, effects=Effects()) for n, s in chosen.items()})
    spoilt = speeds({n: replace(s, effects=TYPICAL) for n, s in chosen.items()})
    return [
        {
            'scene': name,
            'times real time': without[name],
            'with all effects': spoilt[name],
        }
        for name in chosen
    ]


def scenes() -> dict[str, Scene]:
    """Return the scenes by name."""
    driven = load_scene('room', 'figure_of_eight')
    return {
        **{name: load_scene(name) for name in scene_names()},
        'room, driven in, a person walks': replace(driven, movers=load_scene('crossing').movers),
    }


def speeds(scenes: dict[str, Scene]) -> dict[str, float]:
    """Return how many seconds of each scene are simulated in one."""
    times = interleaved({name: _simulation(scene) for name, scene in scenes.items()}, ROUNDS)
    return {name: DURATION / own for name, (own, _) in zip(scenes, times, strict=True)}


def _simulation(scene: Scene) -> Callable[[], object]:
    return lambda: simulate(scene, reference_nod(), DURATION, start_ns=START_NS)

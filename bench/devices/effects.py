"""What each effect of the simulator costs per scan and how far it moves the result, by scene.

Each effect is added, alone and with the size that it has in a real set-up, to a scene without any;
so are moving people. A scene requires an effect that moves one of three figures by more than a
threshold. Where the robot stands, points are assembled without odometry.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

from nodlidar_common.parameters import limits_of
from nodlidar_demo.evaluation import points_of_log
from nodlidar_demo.simulated_log import simulated_drive, simulated_log
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.device_section import load_lidar, load_servo
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.planar import to_space
from nodlidar_sim.world.scene import load_scene, Scene, scene_names
import numpy as np

from bench.shared.reference import REFERENCE_N_S, reference_nod, SPAN, START_NS
from bench.shared.report import Row
from bench.shared.rms import rms
from bench.shared.timing import interleaved

DURATION = 40.0
SEEDS = range(5)
ROUNDS = 9
TYPICAL = Effects(
    range_noise=0.01,
    dropouts=0.02,
    servo_jitter=0.003,
    clock_drift=50.0,
    odometry_error=0.02,
    wheel_slip=0.02,
    heading_drift=0.001,
)
"""Of a URG-04LX, a servo that follows its nod, a quartz clock, and wheels on a floor."""
LEAST_CHANGE = 0.10  # of the RMS distance, that counts
LEAST_SHARE = 0.01  # of the points lost, or of the beams repeated, that counts
NONE, LIDAR, SERVO, PEOPLE, ALL = 'none', 'lidar', 'servo', 'people', 'all'
SETS = {LIDAR: 'urg_04lx_ug01', SERVO: 'rx24f'}
LINEAR = 0.58  # pitch up to which the nod is steady; beyond, it reverses [rad]
THINNING = 10  # one of this many points is compared with the surfaces

# The building is of the corridor's kind.
SCENES = [name for name in scene_names() if name != 'building']
TITLE = (
    f'Effects of typical size: what they cost and what they move, {DURATION:.0f} s at N_s = '
    f'{REFERENCE_N_S}, slerp; required for what they move: RMS by more than '
    f'{LEAST_CHANGE:.0%}, points and repeats by more than {LEAST_SHARE:.0%} of the beams'
)


@dataclass(frozen=True, slots=True)
class Figures:
    """The figures of a recording.

    Attributes
    ----------
    rms
        RMS distance of the points, in the frame of odometry, to the static surfaces [m].
    points
        Their number.
    repeats
        Share of the beams, where the nod is steady, that fall into a cell of the finest grid
        (azimuth step x rows of span / N_s) that an earlier beam hit.
    """

    rms: float
    points: float
    repeats: float


def results() -> list[Row]:
    """Return a row for each scene and effect."""
    return [row for name in SCENES for row in scene_rows(load_scene(name, ideal=True))]


def scene_rows(scene: Scene, rounds: int = ROUNDS) -> list[Row]:
    """Return the rows of one scene."""
    scenes = variants(scene)
    times = interleaved({name: _simulation(one) for name, one in scenes.items()}, rounds)
    found = {name: median_figures(one) for name, one in scenes.items()}
    bare, ((bare_time, _), *_) = found[NONE], times
    return [
        {
            'scene': scene.name,
            'effect': name,
            'size': size_in_words(name),
            'time per scan [us]': own / DURATION * 0.1 * 1e6,
            'to that of none': own / bare_time,
            'RMS to the surfaces [mm]': found[name].rms * 1e3,
            'points lost [%]': (1.0 - found[name].points / bare.points) * 100.0,
            'repeats [%]': found[name].repeats * 100.0,
            'required for': moved(found[name], bare),
        }
        for name, (own, _) in zip(scenes, times, strict=True)
    ]


def variants(scene: Scene) -> dict[str, Scene]:
    """Return a scene without effects, with each alone, and with all, by the effect's name.

    All are those of Effects and the people. The sets of lidar and servo, with their own errors,
    are only tried alone.
    """
    bare = replace(scene.ideal(), movers={})
    alone = {f.name: {f.name: getattr(TYPICAL, f.name)} for f in fields(Effects)}
    sets = {
        LIDAR: replace(bare, lidar=load_lidar(SETS[LIDAR])),
        SERVO: replace(bare, servo=load_servo(SETS[SERVO])),
    }
    people = {PEOPLE: replace(bare, movers=scene.movers)} if scene.movers else {}
    return {
        NONE: bare,
        **{name: replace(bare, effects=Effects(**effect)) for name, effect in alone.items()},
        **sets,
        **people,
        ALL: replace(scene.ideal(), effects=TYPICAL),
    }


def moved(found: Figures, without: Figures) -> str:
    """Return the names of the figures that an effect moves by more than its threshold."""
    changes = {
        'RMS': abs(found.rms / without.rms - 1.0) > LEAST_CHANGE,
        'points': abs(found.points / without.points - 1.0) > LEAST_SHARE,
        'repeats': abs(found.repeats - without.repeats) > LEAST_SHARE,
    }
    return ', '.join(name for name, counts in changes.items() if counts)


def size_in_words(name: str) -> str:
    """Return the size of an effect with its unit, or the set of a device; empty for the others."""
    if name in SETS:
        return SETS[name]
    unit = {f.name: limits_of(f).unit for f in fields(Effects)}
    return f'{getattr(TYPICAL, name):g} {unit[name]}'.strip() if name in unit else ''


def median_figures(scene: Scene) -> Figures:
    """Return the median of each figure over recordings with other random numbers."""
    found = [figures(recording(scene, seed)) for seed in SEEDS]
    return Figures(
        *(float(np.median([getattr(one, f.name) for one in found])) for f in fields(Figures))
    )


def recording(scene: Scene, seed: int = 0) -> Recording:
    """Return the reference sensor's recording of a scene."""
    return simulate(scene, reference_nod(), DURATION, seed, start_ns=START_NS)


def figures(simulated: Recording) -> Figures:
    """Return the figures of a recording whose points are assembled as in the node."""
    scene = simulated.world.scene
    log = simulated_drive(simulated) if scene.drives else simulated_log(simulated)
    points = points_of_log(log, 'slerp').xyz
    some = points[::THINNING] if scene.drives else scene.mount.to_parent(points[::THINNING])
    in_world = to_space(np.array(scene.base_start)).to_parent(some)
    distance = scene.surfaces.surface_distance(in_world)
    return Figures(rms(distance), len(points), repeats(simulated))


def repeats(simulated: Recording) -> float:
    """Return the share of repeats among the beams where the nod is steady."""
    pitch = simulated.true_pitch
    row = np.floor((pitch / SPAN + 0.5) * REFERENCE_N_S).astype(np.int64)
    cell = np.arange(pitch.shape[1]) * REFERENCE_N_S + row
    steady = cell[np.abs(pitch) < LINEAR]
    return 1.0 - len(np.unique(steady)) / len(steady)


def _simulation(scene: Scene) -> Callable[[], object]:
    return lambda: recording(scene)

"""The field sigma against the true errors of the points, in scenes as shipped.

The error of a point is its displacement from the true end of its beam. Lidar and servo have their
errors; the mixed pixels that the filter leaves count.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from nodlidar_assembler.bags.sensor_log import outcomes
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig
from nodlidar_assembler.clouds.points import nod_in_place
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_common.arrays import Array
from nodlidar_common.nod import Nod
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.device_section import load_lidar
from nodlidar_sim.world.scene import load_scene
import numpy as np

from bench.shared.reference import BEAM_PERIOD, reference_nod, START_NS
from bench.shared.report import Row
from bench.shared.scans import samples_for
from bench.shared.timing import interleaved

DURATION = 8.0
SCENES = ('room', 'corridor', 'corner')
LIDAR = 'urg_04lx_ug01'
ROUNDS = 300
DEFAULT = NodConfig()
SLOW, FAST = 'default', 'pi rad/s'
NODS = {
    SLOW: Nod(
        DEFAULT.pitch_min,
        DEFAULT.pitch_max,
        DEFAULT.samples_per_sweep * BEAM_PERIOD,
        DEFAULT.samples_per_sweep,
        START_NS,
    ),
    FAST: reference_nod(),
}
CONFIG = PipelineConfig(sigma_field=True)
BELOW, BELOW_TWO = 'below sigma [%]', 'below 2 sigma [%]'
TIME = 'time of sigma per scan [us]'
TITLE = f'Points whose true error is below their sigma, scenes as shipped, {DURATION:.0f} s each'


def results() -> list[Row]:
    """Return the shares of points below their sigma by scene and nod, and the time of sigma."""
    return [*(row_of(scene, nod) for scene in SCENES for nod in NODS), time_of_sigma()]


def row_of(scene: str, nod: str, duration: float = DURATION) -> Row:
    """Return the shares of the points of a recording [s] in a scene, by the name of the nod."""
    room = replace(load_scene(scene), lidar=load_lidar(LIDAR))
    ratio = np.concatenate(list(_ratios(simulate(room, NODS[nod], duration, start_ns=START_NS))))
    return {
        'scene': scene,
        'nod': nod,
        BELOW: 100.0 * float(np.mean(ratio < 1.0)),
        BELOW_TWO: 100.0 * float(np.mean(ratio < 2.0)),
    }


def _ratios(seen: Recording) -> Iterator[Array]:
    """Yield the errors of the points of each scan, each divided by its sigma."""
    for number, outcome in enumerate(outcomes(simulated_log(seen), CONFIG)):
        if outcome.assembled is None:
            continue  # the first and the last scan lack samples
        placed, beams = outcome.assembled.placed, outcome.assembled.beams
        true = beams.direction * seen.true_range[number] + beams.laser_pose.position[:, None]
        off = placed.xyz - nod_in_place(true, seen.true_pitch[number])[:, placed.indices]
        yield np.linalg.norm(off, axis=0) / placed.sigma


def time_of_sigma() -> Row:
    """Return the time [us] that the field adds to a scan."""
    seen = simulate(load_scene('room'), NODS[FAST], 1.0, start_ns=START_NS)
    log = simulated_log(seen)
    scan, actions = log.scans[4], {}
    for wanted in (True, False):
        pipeline = Pipeline(replace(CONFIG, sigma_field=wanted))
        samples = samples_for(scan, log, pipeline)
        actions[str(wanted)] = partial(pipeline.add_scan, scan, *samples)
    (with_it, _), (without, _) = interleaved(actions, ROUNDS)
    return {TIME: (with_it - without) * 1e6, 'without it [us]': without * 1e6}

"""The nod that finds an object soonest, chosen while somebody waits."""

from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_planner.choice.choice import quick_choice
from nodlidar_planner.pattern.band import coprime_from
from nodlidar_planner.sweeps.schedule import even_rows
import numpy as np

CANDIDATES = 300
SLOWEST = 4  # times as many samples as the fastest nod


def samples_for(config: NodConfig) -> int:
    """Return the N_s that sees the object of a configuration soonest, with its servo.

    Raises
    ------
    ParameterError
        If no N_s ever does.
    """
    task = config.task
    fewest = config.fewest_samples(task.span, task.beam_period)
    spread = np.linspace(fewest, SLOWEST * fewest, CANDIDATES).astype(np.int64)
    coprime = {coprime_from(n_s, task.steps_per_revolution) for n_s in spread.tolist()}
    slowest_first = np.array(sorted(coprime, reverse=True))
    return quick_choice(even_rows(task), slowest_first, config.timing_error)

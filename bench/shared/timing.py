"""Times of actions beside a yardstick, so that machines can be compared.

The yardstick is a fixed piece of NumPy, timed right before and after each action, so that other
load affects both. Times are processor times; the lower quartile counts.
"""

from collections.abc import Callable, Mapping
from itertools import product
import time

from nodlidar_common.arrays import Array
import numpy as np

Action = Callable[[], object]

LEAST_TIME = 2e-3  # of the repetitions of an action in each round [s]


def interleaved(actions: Mapping[str, Action], rounds: int) -> list[tuple[float, float]]:
    """Return lower quartiles of the times of each action and of the yardstick beside it [s].

    Each round runs all actions, so that a disturbance affects one round of each.
    """
    repeats = {name: _repeats(action) for name, action in actions.items()}
    of_yardstick = _repeats(yardstick)
    times = np.empty((rounds, len(actions), 2))
    for k, (i, (name, action)) in product(range(rounds), enumerate(actions.items())):
        before = _time(yardstick, of_yardstick)
        own = _time(action, repeats[name])
        times[k, i] = own, (before + _time(yardstick, of_yardstick)) / 2.0
    return [(float(own), float(beside)) for own, beside in np.quantile(times, 0.25, axis=0)]


def yardstick() -> float:
    """Do fixed work, similar to that for a scan: calls and arithmetic on 682 numbers."""
    x: Array = np.arange(682, dtype=np.float64)
    for _ in range(20):
        x = np.sqrt(x * x + 1.0)
    return float(x.sum())


def _repeats(action: Action) -> int:
    action()
    return max(round(LEAST_TIME / _time(action, 1)), 1)


def _time(action: Action, repeats: int) -> float:
    begin = time.thread_time()
    for _ in range(repeats):
        action()
    return (time.thread_time() - begin) / repeats

"""Clouds to a consumer on another machine: what arrives of those of a scan and of a sweep."""

from dataclasses import dataclass
from pathlib import Path
import tempfile
import time

import numpy as np

from bench.network.machines import Line, Machines
from bench.network.network import DEFAULT, ENVIRONMENT, LOSSY, profiles
from bench.network.network_listener import arrivals
from bench.network.network_rig import listening, Site, talking
from bench.shared.report import Row

COUNT = 30
# Size and period, as measured by `bandwidth` [bytes], [s].
SIZES = {'scan': (15_000, 0.1), 'sweep': (100_000, 0.4)}
DELAY, JITTER = 0.02, 0.005
TITLE = f'{COUNT} clouds to another machine, over a line with a delay of 20 to 25 ms'
_SETTLED = 6.0  # for the last ones to be sent again [s]


@dataclass(frozen=True, slots=True)
class Case:
    """What a cloud is of, the share of lost packets, the QoS and the profiles."""

    of: str
    loss: float
    reliability: str
    profiles: str


CASES = [
    Case(of, loss, reliability, file)
    for of in SIZES
    for loss in (0.0, 0.01, 0.05)
    for reliability, file in (
        ('reliable', DEFAULT),
        ('reliable', LOSSY),
        ('best_effort', DEFAULT),
    )
]


def results() -> list[Row]:
    """Return the share that arrives, and how late, by size, loss and QoS."""
    return [measured(case) for case in CASES]


def measured(case: Case) -> Row:
    """Return the row of a case."""
    size, period = SIZES[case.of]
    environment = ENVIRONMENT | profiles(case.profiles)
    with tempfile.TemporaryDirectory(prefix='network-') as name, Machines(Line()) as machines:
        robot, far = (Site(each, environment) for each in (machines.robot, machines.far))
        file = Path(name) / 'there'
        topic = f'points=sensor_msgs/msg/PointCloud2={case.reliability}'
        with (
            listening(far, file, [topic]),
            talking(robot, Path(name) / 'talker', size, COUNT, period, 1.0),
        ):
            _until_first(file)
            machines.line = Line(case.loss, DELAY, JITTER)
            begin = time.monotonic()
            while sum(1 for _ in arrivals(file)) < COUNT:
                if time.monotonic() - begin > COUNT * period + _SETTLED:
                    break
                time.sleep(0.1)
        found = list(arrivals(file))[1:]  # the first one came before
    late = [(each.arrived_ns - each.published_ns) / 1e6 for each in found]
    return {
        'cloud of a': case.of,
        'size [kB]': size / 1e3,
        'lost packets [%]': 100.0 * case.loss,
        'reliability': case.reliability.replace('_', ' '),
        'profiles': case.profiles,
        'arrived [%]': 100.0 * len(found) / (COUNT - 1),
        'late, median [ms]': float(np.median(late)) if late else None,
        'late, longest [ms]': max(late, default=None),
    }


def _until_first(file: Path) -> None:
    deadline = time.monotonic() + 30.0
    while not any(True for _ in arrivals(file)):
        if time.monotonic() > deadline:
            raise TimeoutError('no cloud came')
        time.sleep(0.02)

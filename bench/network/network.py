"""Driver and servo on one machine, the assembler on another, over lines that delay and lose.

Each machine is a network namespace (see bench.network.machines), the nodes are real, the devices
emulated.
"""

from dataclasses import dataclass
import os
from pathlib import Path
import tempfile
import time

from ament_index_python.packages import get_package_share_directory
from nodlidar_bringup.ros.discovery import PROFILE_VARIABLES
import numpy as np

from bench.network.machines import Line, Machines
from bench.network.network_judgement import account
from bench.network.network_rig import NetworkRig, Site
from bench.shared.report import Row

DURATION = 10.0
SETTLED = 3.0  # until all that is on its way has arrived or is lost, and was counted [s]
LOSSES, DELAYS = (0.0, 0.01, 0.05), ((0.0, 0.0), (0.02, 0.005), (0.2, 0.05))
TITLE = f'Assembler on another machine than driver and servo, {DURATION:.0f} s each'
BEST_EFFORT = [
    f'qos_overrides./{topic}.subscription.reliability:=best_effort'
    for topic in ('scan', 'joint_states')
]
# All messages go by the network cards, also those between processes of one machine.
ENVIRONMENT = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}


DEFAULT, LOSSY = 'fast_discovery.xml', 'lossy_network.xml'


@dataclass(frozen=True, slots=True)
class Case:
    """A line, the profiles of Fast DDS, and the assembler's QoS and deadline [s]."""

    line: Line
    profiles: str = DEFAULT
    reliable: bool = True
    deadline: float = 0.3


CASES = [
    Case(Line(loss, delay, jitter), *setup)
    for setup in ((DEFAULT, True, 0.3), (LOSSY, True, 2.0), (DEFAULT, False, 0.3))
    for loss in LOSSES
    for delay, jitter in DELAYS
]


def results() -> list[Row]:
    """Return what arrives, what is late and what is wrong, by line and reliability."""
    return [measured(case) for case in CASES]


def measured(case: Case) -> Row:
    """Return the row of a case."""
    environment = ENVIRONMENT | profiles(case.profiles)
    with (
        tempfile.TemporaryDirectory(prefix='network-') as folder,
        Machines(case.line) as machines,
    ):
        robot, far = (Site(each, environment) for each in (machines.robot, machines.far))
        parameters = [f'deadline:={case.deadline}', *([] if case.reliable else BEST_EFFORT)]
        rig = NetworkRig(Path(folder), robot, far, parameters)
        with rig.running():
            begin = time.monotonic()
            rig.until_clouds(1)
            first = time.monotonic() - begin
            sent = list(machines.sent)
            time.sleep(DURATION)
            rates = (np.array(machines.sent) - sent) / DURATION / 1e3
            rig.end_scans()
            time.sleep(SETTLED)
        found = account(rig.here(), rig.there(), rig.truth)
    line, late = case.line, np.percentile(found.late, [50, 99]) * 1e3
    return {
        'loss [%]': 100.0 * line.loss,
        'delay [ms]': _interval(line),
        'profiles': case.profiles,
        'deadline [s]': case.deadline,
        'scans': 'reliable' if case.reliable else 'best effort',
        'first cloud [s]': first,
        'sent': found.sent,
        'clouds': found.clouds,
        'lost on the way': found.lost,
        'dropped': sum(found.dropped.values()),
        'unaccounted': found.unaccounted,
        'late, median [ms]': float(late[0]),
        'late, 99 % [ms]': float(late[1]),
        'error, worst [mm]': float(found.error.max() * 1e3),
        'reasons': ', '.join(f'{n} {why}' for why, n in found.dropped.items()),
        'from the robot [kB/s]': float(rates[0]),
        'to the robot [kB/s]': float(rates[1]),
    }


def profiles(name: str) -> dict[str, str]:
    """Return the variables of the environment that select a file of nodlidar_bringup/config."""
    path = os.path.join(get_package_share_directory('nodlidar_bringup'), 'config', name)
    return dict.fromkeys(PROFILE_VARIABLES, path)


def _interval(line: Line) -> str:
    low, high = line.delay * 1e3, (line.delay + line.jitter) * 1e3
    return f'{low:.0f} to {high:.0f}' if line.jitter else f'{low:.0f}'

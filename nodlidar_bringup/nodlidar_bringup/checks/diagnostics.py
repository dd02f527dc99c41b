"""Checks of what the nodes report about themselves in /diagnostics."""

from dataclasses import dataclass
import re

from nodlidar_bringup.checks.finding import fault, Finding, good, unknown, warning
from nodlidar_bringup.checks.graph import KILLED, SOURCES
from nodlidar_bringup.checks.ports import INSTALL_RULES

NODES = (*SOURCES.values(), 'mapper')
"""Nodes of ours that report; all others of a robot do so on the same topic."""

_BUSY = 'end other programs (`top`), or profile:=fast'
# What fixes a status that has these words; the first that matches.
_REMEDIES = (
    ('latency|holds replies back', INSTALL_RULES),
    ('sweeps disagree', 'ros2 run nodlidar_assembler calibrate live, where nothing moves'),
    ('publishers o[fn]', f'ros2 topic info -v names their nodes: end all but one; {KILLED}'),
    ('in the future', 'sudo apt install chrony, on both computers'),
    ('lidar covered', 'ros2 run nodlidar_driver probe draws what the lidar sees'),
    (
        'no odometry|TF:',
        'ros2 run tf2_ros tf2_echo odom base_link shows odometry',
    ),
    ('permission denied', 'sudo usermod -aG dialout $USER, then log out and in again'),
    ('does not exist', 'plug the device in; `ls -l /dev/serial/by-id` shows what is there'),
    ('in use by another', 'end the other program: `fuser -v` and the port show it'),
    (
        'wheel mode|multi-turn|angle limits',
        'ros2 run nodlidar_servo setup, which sets the limits of the servo',
    ),
    ('shut down|overload|overheating', 'remove what blocks the nod, then start the servo again'),
    ('supply|voltage', 'supply the servo with what its model needs (docs/hardware.md)'),
    ('late reply;.*no answer', _BUSY),  # the more frequent one comes first
    (
        'does not answer|no answer|sent nothing',
        'check supply, cable, bit rate and ID of the device',
    ),
    ('no joint', 'ros2 topic hz joint_states'),
    ('clock drift|time mode', 'use a USB port of the computer itself, without a hub'),
    ('clock was set', 'use a service that slews the clock: sudo apt install chrony'),
    ('late|per second|scans/s', _BUSY),
)
_OTHERWISE = 'ros2 topic echo /diagnostics shows all of it; docs/faults.md says what it means'


@dataclass(frozen=True, slots=True)
class Status:
    """One status of /diagnostics: its name, level (0 OK, 1 warning, 2 error, 3 stale), message."""

    name: str
    level: int
    message: str


def check_diagnostics(statuses: tuple[Status, ...], namespace: str = '') -> list[Finding]:
    """Return a finding for each status of a sensor that is not OK.

    Parameters
    ----------
    statuses
        All statuses, also those of other sensors and of other programs.
    namespace
        Of the sensor, without a slash at the end.
    """
    own = [f'{namespace}/{node}' for node in NODES]
    statuses = tuple(each for each in statuses if f'/{each.name.partition(":")[0]}' in own)
    if not statuses:
        text = 'no node of the sensor published /diagnostics while it was watched'
        return [unknown('diagnostics', text)]
    findings = [_finding(status) for status in statuses if status.level]
    return findings or [good('diagnostics', f'{len(statuses)} statuses are OK')]


def _finding(status: Status) -> Finding:
    words = f'{status.name}: {status.message}'
    remedies = [remedy for words_of, remedy in _REMEDIES if re.search(words_of, words, re.I)]
    remedy = remedies[0] if remedies else _OTHERWISE
    return (warning if status.level == 1 else fault)('reported', words, remedy)

"""Checks of the messages that arrive: rates, stamps, content."""

from collections.abc import Sequence
from dataclasses import dataclass, field
import math

from nodlidar_assembler.clouds.reversals import ReversalFinder
from nodlidar_bringup.checks.finding import fault, Finding, good, unknown, warning
from nodlidar_bringup.checks.graph import LAUNCH, SOURCES, START_AGAIN
import numpy as np

LEAST_RATE = {'scan': 5.0, 'joint_states': 12.0, 'points': 0.5}
"""Slowest use of each topic [Hz]: a slow lidar, `profile:=fast`, clouds of short sweeps."""

LEAST_SHARE = 0.6
"""Share of the messages of long clouds that has to come: one may have begun before the watch."""

LARGEST_FUTURE = 0.02
"""By how much a stamp may be ahead of the clock [s]."""

HOST, SIMULATED = "this computer's clock", '/clock'
"""Clocks with which stamps are compared."""

LARGEST_AGE = 2.0
"""Age of a message's end that is not worth a finding [s]: computing, the wait for odometry."""

LEAST_VALID = 0.02
"""Share of the beams that see something, in any room."""

LEAST_NOD = 0.02
"""Least movement of a joint that nods [rad]."""


@dataclass(frozen=True, slots=True)
class Traffic:
    """The messages of one topic while it was watched.

    Attributes
    ----------
    topic
        Its name.
    seconds
        How long it was watched [s].
    ages
        Time from each message's stamp to its arrival [s].
    steps
        Time from each stamp to the next one [s].
    unstamped
        Number of messages with the stamp 0.
    frames
        Frames of the messages.
    published
        Whether the topic has a publisher.
    namespace
        Of the sensor, without a slash at the end.
    lasts
        Time from first to last point of a message [s], at most.
    clock
        With which ages are measured: HOST or SIMULATED.
    """

    topic: str
    seconds: float
    ages: Sequence[float] = ()
    steps: Sequence[float] = ()
    unstamped: int = 0
    frames: frozenset[str] = frozenset()
    published: bool = True
    namespace: str = ''
    lasts: float = 0.0
    clock: str = HOST


@dataclass(frozen=True, slots=True)
class Content:
    """What the messages say.

    Attributes
    ----------
    valid_share
        Share of the beams of all scans with a range; None without scans.
    joint_name
        Name of the nod joint.
    joint_names
        Names of the joints in the joint states.
    positions
        Positions of the nod joint [rad]; NaN where a joint state has none.
    namespace
        Of the sensor, without a slash at the end.
    followed
        Whether anybody listens to the nod command.
    """

    valid_share: float | None = None
    joint_name: str = 'nod_joint'
    joint_names: frozenset[str] = frozenset()
    positions: Sequence[float] = field(default=())
    namespace: str = ''
    followed: bool = True


def check_traffic(traffic: Traffic) -> list[Finding]:
    """Return what is wrong with the messages of one topic."""
    if not traffic.published:
        return []
    count = len(traffic.ages) + traffic.unstamped
    name, node = f"'{traffic.topic}'", SOURCES.get(traffic.topic, 'publisher')
    if not count:
        text = f'no message came on {name} in {traffic.seconds:.0f} s'
        if traffic.seconds < 2.0 * traffic.lasts:
            text = f'{text}; one may take {traffic.lasts:.0f} s'
            longer = f'ros2 run nodlidar_bringup doctor --seconds {2.0 * traffic.lasts:.0f}'
            return [unknown('silent topic', text, longer)]
        return [fault('silent topic', text, f'ros2 topic echo /diagnostics, and see the {node}')]
    findings = _stamps(traffic, name)
    rate, least = count / traffic.seconds, LEAST_RATE.get(traffic.topic, 0.0)
    if traffic.lasts:
        least = min(least, LEAST_SHARE / traffic.lasts)
    if rate < least:
        text = f'{name} comes {rate:.3g} times a second, at least {least:.3g} are usual'
        remedy = f'ros2 topic echo /diagnostics says why the {node} is slow; try profile:=fast'
        findings.append(warning('low rate', text, remedy))
    return findings or [good('rate', f'{name} comes {rate:.3g} times a second')]


def _stamps(traffic: Traffic, name: str) -> list[Finding]:
    if traffic.unstamped:
        text = f'{traffic.unstamped} messages on {name} have no stamp'
        return [fault('no stamp', text, 'use a driver that stamps each message when it measures')]
    findings = []
    age = float(np.median(np.asarray(traffic.ages)))
    if age < -LARGEST_FUTURE:
        text = f'stamps on {name} are {-age:.2g} s ahead of {traffic.clock}'
        findings.append(fault('stamps in the future', text, _synchronise(traffic.clock)))
    elif age > LARGEST_AGE + traffic.lasts:
        text = f'stamps on {name} are {age:.2g} s behind {traffic.clock}'
        findings.append(fault('stamps in the past', text, _synchronise(traffic.clock)))
    backwards = sum(step < 0.0 for step in traffic.steps)
    if backwards:
        text = f'stamps on {name} go back {backwards} times'
        full = f'{traffic.namespace}/{traffic.topic}'
        remedy = f'ros2 topic info -v {full} shows who publishes; end all but one'
        findings.append(fault('stamps go back', text, remedy))
    return findings


def check_together(scans: Traffic, joints: Traffic, deadline: float) -> list[Finding]:
    """Return whether joint states come too late for the scans, which wait for a deadline [s]."""
    if not scans.ages or not joints.ages:
        return []
    behind = float(np.median(joints.ages) - np.median(scans.ages))
    if behind < deadline:
        return []
    text = (
        f"stamps on '{joints.topic}' are {behind:.2g} s behind those on '{scans.topic}': no scan "
        f'waits so long (deadline: {deadline:g} s)'
    )
    remedy = 'stamp joint states when they are measured, by the clock that stamps the scans'
    return [fault('joint states late', text, remedy)]


def _synchronise(clock: str) -> str:
    if clock == SIMULATED:
        return 'ros2 topic info -v /clock shows who publishes; end all but one, as a second bag'
    return (
        'synchronise the clocks of all computers (sudo apt install chrony; chronyc makestep), or '
        'with a bag: ros2 bag play --clock and use_sim_time'
    )


def stands_still(content: Content) -> bool:
    """Return whether the joint has positions, but hardly moves."""
    positions = [each for each in content.positions if math.isfinite(each)]
    return bool(positions) and max(positions) - min(positions) < LEAST_NOD


def shows_sweep(content: Content) -> bool:
    """Return whether the joint went from one reversal to another: that is a whole sweep."""
    finder, positions = ReversalFinder(), filter(math.isfinite, content.positions)
    return sum(finder.add(k, each) is not None for k, each in enumerate(positions)) > 1


def check_content(content: Content) -> list[Finding]:
    """Return what is wrong with what scans and joint states say."""
    findings = []
    if content.valid_share is not None and content.valid_share < LEAST_VALID:
        text = f'only {content.valid_share:.1%} of the beams see anything'
        remedy = 'clean the window of the lidar, take off its cover, turn it towards the room'
        findings.append(fault('lidar sees nothing', text, remedy))
    if content.joint_names and content.joint_name not in content.joint_names:
        names = ', '.join(sorted(content.joint_names))
        text = f"joint_states have no joint '{content.joint_name}', but {names}"
        remedy = f'{LAUNCH} frame_prefix:=... as in the names, or joint_name in assembler_params'
        findings.append(fault('joint missing', text, remedy))
    positions = [each for each in content.positions if math.isfinite(each)]
    if content.positions and not positions:
        text = f"joint_states have no position of '{content.joint_name}'"
        remedy = 'publish the measured position of each joint in the order of the names'
        findings.append(fault('no joint position', text, remedy))
    if stands_still(content):
        text = f'the joint stands still at {positions[-1]:.3f} rad'
        remedy = (
            f'ros2 topic echo --once {content.namespace}/servo/status, and /diagnostics: torque, '
            'the supply of the servo, command_nod of the assembler'
        )
        if not content.followed:
            text = f"{text}: nobody listens to 'nod_command', no servo runs, or it hangs"
            remedy = f'{START_AGAIN}, and read what the servo says'
        findings.append(fault('joint stands still', text, remedy))
    return findings

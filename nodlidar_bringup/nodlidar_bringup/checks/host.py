"""Checks of the computer: clocks and processor."""

from dataclasses import dataclass

from nodlidar_bringup.checks.finding import fault, Finding, good, unknown, warning
from nodlidar_bringup.checks.graph import LAUNCH

EARLIEST_NS = 1_735_689_600_000_000_000
"""2025-01-01: a clock before that was never set, as after the start of a computer without one."""

LARGEST_STEP = 0.002
"""Step of the system clock that is not worth a finding [s]; slewing is up to 500 ppm."""

NODES_CORES = 0.21
"""Share of a core that all nodes take at `balanced` where the yardstick takes REFERENCE [s]
(`python -m bench processor_time`)."""

REFERENCE = 0.0018
"""Time of the yardstick on the machine of the recorded measurements [s]."""

LEAST_IDLE = 0.15
"""Share of all cores that has to be idle while the nodes run."""

SELF_GOVERNED = ('intel_pstate', 'amd-pstate-epp')
"""Frequency drivers, in active mode, whose governor 'powersave' follows the load (Linux'
admin-guide/pm/intel_pstate and amd-pstate). In passive mode they have other names."""

_FAST = f'{LAUNCH} profile:=fast'


@dataclass(frozen=True, slots=True)
class Host:
    """The computer.

    Attributes
    ----------
    now_ns
        Its clock [ns].
    synchronised
        Whether the kernel takes its clock for synchronised; None if unknown.
    clock_step
        By how much the clock was set while it was watched [s].
    cores
        Number of cores that this process may use.
    busy
        Share of all cores that was in use while they were watched, 0 to 1.
    yardstick
        Time that a fixed piece of NumPy takes [s].
    governor, frequency_driver
        Of the processor's frequency; empty if unknown.
    nodes_run
        Whether the sensor's nodes were running meanwhile.
    """

    now_ns: int
    synchronised: bool | None = True
    clock_step: float = 0.0
    cores: int = 4
    busy: float = 0.0
    yardstick: float = REFERENCE
    governor: str = ''
    frequency_driver: str = ''
    nodes_run: bool = False


def check_host(host: Host) -> list[Finding]:
    """Return what is wrong with the computer."""
    return [*_check_clock(host), *_check_processor(host)]


def _check_clock(host: Host) -> list[Finding]:
    remedy = 'sudo timedatectl set-ntp true'
    if host.now_ns < EARLIEST_NS:
        return [fault('clock never set', 'the system clock is before 2025', remedy)]
    if abs(host.clock_step) > LARGEST_STEP:
        text = f'the system clock was set by {host.clock_step * 1e3:+.0f} ms while it was watched'
        remedy = 'use a service that slews the clock: sudo apt install chrony'
        return [fault('clock steps', text, remedy)]
    if host.synchronised is None:
        return [unknown('clock', 'the kernel does not say whether its clock is synchronised')]
    if not host.synchronised:
        text = 'the system clock is not synchronised; that matters with more than one computer'
        return [warning('clock not synchronised', text, remedy)]
    return [good('clock', 'the system clock is synchronised and steady')]


def _check_processor(host: Host) -> list[Finding]:
    findings = []
    if host.governor == 'powersave' and host.frequency_driver not in SELF_GOVERNED:
        text = "the processor's frequency is kept low (governor 'powersave')"
        findings.append(warning('power saving', text, 'sudo cpupower frequency-set -g schedutil'))
    slower = host.yardstick / REFERENCE
    needed = NODES_CORES * slower
    idle = host.cores * (1.0 - host.busy)
    if not host.nodes_run and needed > host.cores * (1.0 - LEAST_IDLE):
        text = f'the nodes need {needed:.1f} cores of this processor, which has {host.cores}'
        return [*findings, fault('processor too slow', text, _FAST)]
    short = 1.0 - host.busy < LEAST_IDLE if host.nodes_run else idle < needed
    if short:
        text = f'{host.busy:.0%} of {host.cores} cores are in use: scans will be late or dropped'
        remedy = f'see `top`, end what is not needed, or {_FAST}'
        return [*findings, fault('processor busy', text, remedy)]
    text = f'{idle:.1f} of {host.cores} cores are idle'
    if not host.nodes_run:
        text += f', the nodes need about {needed:.1f}'
    return [*findings, good('processor', text)]

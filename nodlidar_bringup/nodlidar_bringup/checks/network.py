"""Checks of how ROS communicates on this computer."""

from dataclasses import dataclass

from nodlidar_bringup.checks.finding import fault, Finding, good, warning

SAFE_DOMAINS = (*range(102), *range(215, 233))
"""Others up to 232 use ports that Linux gives to other programs (ROS 2 documentation,
"The ROS_DOMAIN_ID")."""

LEAST_SHARED_MEMORY = 32e6
"""Free bytes that Fast DDS should have for the messages between processes."""

_RANGES = ('SUBNET', 'LOCALHOST', 'OFF', 'SYSTEM_DEFAULT', '')


@dataclass(frozen=True, slots=True)
class Network:
    """Environment variables by which ROS communicates, and what they refer to.

    Attributes
    ----------
    domain_id, discovery_range, middleware, profiles_file
        ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE, RMW_IMPLEMENTATION, and
        FASTDDS_DEFAULT_PROFILES_FILE or its former name; empty if not set.
    installed
        The installed middlewares.
    profiles_exist
        Whether the file of profiles exists.
    localhost_only
        Whether the outdated ROS_LOCALHOST_ONLY is 1.
    shared_memory
        Free bytes of /dev/shm; None if there is none.
    """

    domain_id: str = ''
    discovery_range: str = ''
    middleware: str = ''
    profiles_file: str = ''
    installed: tuple[str, ...] = ('rmw_fastrtps_cpp',)
    profiles_exist: bool = True
    localhost_only: bool = False
    shared_memory: float | None = 1e9


def check_network(network: Network) -> list[Finding]:
    """Return what keeps nodes from hearing each other."""
    findings = [*_check_domain(network), *_check_discovery(network), *_check_files(network)]
    text = f'domain {network.domain_id or 0}, {network.discovery_range or "SUBNET"}'
    return findings or [good('network', f'ROS communicates in {text}')]


def _check_domain(network: Network) -> list[Finding]:
    text = network.domain_id
    remedy = 'export ROS_DOMAIN_ID=0'
    if text in ('', *map(str, SAFE_DOMAINS)):
        return []
    if text in map(str, range(SAFE_DOMAINS[-1])):
        words = f'domain {text} uses ports that Linux gives to other programs as well'
        return [warning('domain', words, remedy)]
    words = f"ROS_DOMAIN_ID is '{text}', which is not a number from 0 to {SAFE_DOMAINS[-1]}"
    return [fault('domain', words, remedy)]


def _check_discovery(network: Network) -> list[Finding]:
    remedy = 'export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST'
    if network.discovery_range not in _RANGES:
        text = f"ROS_AUTOMATIC_DISCOVERY_RANGE is '{network.discovery_range}'"
        return [fault('discovery', f'{text}, which ROS does not know', remedy)]
    if network.discovery_range == 'OFF':
        text = 'ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: no node hears another one'
        return [fault('discovery', text, remedy)]
    if network.localhost_only:
        text = 'ROS_LOCALHOST_ONLY is outdated and overrides the discovery range'
        return [warning('discovery', text, f'unset ROS_LOCALHOST_ONLY; {remedy}')]
    return []


def _check_files(network: Network) -> list[Finding]:
    findings = []
    if network.middleware and network.middleware not in network.installed:
        text = f"RMW_IMPLEMENTATION is '{network.middleware}', which is not installed"
        package = network.middleware.replace('_', '-')
        remedy = f'unset RMW_IMPLEMENTATION, or sudo apt install ros-$ROS_DISTRO-{package}'
        findings.append(fault('middleware', text, remedy))
    if network.profiles_file and not network.profiles_exist:
        text = f"the file of Fast DDS profiles '{network.profiles_file}' does not exist"
        remedy = 'unset FASTDDS_DEFAULT_PROFILES_FILE FASTRTPS_DEFAULT_PROFILES_FILE'
        findings.append(fault('profiles', text, remedy))
    if network.shared_memory is not None and network.shared_memory < LEAST_SHARED_MEMORY:
        text = f'/dev/shm has {network.shared_memory / 1e6:.0f} MB left for messages'
        remedy = 'rm /dev/shm/fastrtps_* when no node runs; in a container --shm-size=512m'
        findings.append(warning('shared memory', text, remedy))
    return findings

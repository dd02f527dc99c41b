"""Checks of the running nodes and their topics."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from nodlidar_bringup.checks.finding import fault, Finding, good, unknown, warning

LAUNCH = 'ros2 launch nodlidar_bringup robot.launch.py'
START_AGAIN = f'end the launch that runs (Ctrl-C), then {LAUNCH}'
SOURCES = {'scan': 'driver', 'joint_states': 'servo', 'points': 'assembler'}
"""Topics of a sensor, and the node of each."""

KILLED = 'one that was killed counts for another 20 s'
"""What to know of a second publisher: that is the lease of Fast DDS (docs/faults.md)."""

LIFECYCLE = ('driver', 'servo')
"""Nodes that publish only while they are active."""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A publisher or a subscription.

    Attributes
    ----------
    node
        Name of its node.
    reliable, transient_local
        Its quality of service: reliable or best effort; whether late subscribers get old messages.
    """

    node: str
    reliable: bool = True
    transient_local: bool = False


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic with its endpoints and message types."""

    name: str
    publishers: tuple[Endpoint, ...] = ()
    subscriptions: tuple[Endpoint, ...] = ()
    types: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Graph:
    """The running nodes.

    Attributes
    ----------
    nodes
        Their full names; one that is there twice is listed twice.
    topics
        Topics of the sensor by their names in `SOURCES`, and others.
    on_sim_time
        Nodes whose parameter use_sim_time is true.
    clock_published
        Whether /clock has a publisher.
    namespace
        Of the sensor, without a slash at the end.
    inactive
        Lifecycle nodes that are not active, and whether they are finalized, for good.
    mute
        Nodes that take requests, but answer none.
    other_joints
        Whether joint states come with the nod joint and without it: those without are of other
        parts of the robot.
    """

    nodes: tuple[str, ...] = ()
    topics: tuple[Topic, ...] = ()
    on_sim_time: tuple[str, ...] = ()
    clock_published: bool = False
    namespace: str = ''
    inactive: Mapping[str, bool] = field(default_factory=dict)
    mute: tuple[str, ...] = ()
    other_joints: bool = False


def is_running(graph: Graph) -> bool:
    """Return whether a node of a sensor runs, or one of its topics has a publisher."""
    return _has_nodes(graph) or any(
        topic.publishers for topic in graph.topics if topic.name in SOURCES
    )


def _has_nodes(graph: Graph) -> bool:
    nodes = {f'{graph.namespace}/{name}' for name in SOURCES.values()}
    return bool(nodes.intersection(graph.nodes))


def check_graph(graph: Graph) -> list[Finding]:
    """Return what is wrong with nodes and topics."""
    if not is_running(graph):
        return [_nothing_runs(graph)]
    findings = [*_twice(graph.nodes), *_mute(graph.mute), *_inactive(graph.inactive)]
    findings += _sim_time(graph)
    for topic in graph.topics:
        full = f'{graph.namespace}/{topic.name}'
        findings += [
            *_publishers(topic, full, graph),
            *_types(topic, full),
            *_mismatches(topic, full),
        ]
    return findings or [good('nodes', f'{len(graph.nodes)} nodes run, each topic has one source')]


def _nothing_runs(graph: Graph) -> Finding:
    spaces = {
        name.removesuffix('/assembler') for name in graph.nodes if name.endswith('/assembler')
    }
    if not spaces:
        text = 'no sensor runs in this ROS domain: its topics, transforms, rates are not checked'
        return unknown('no running system', text, f'{LAUNCH}, then doctor again')
    places = ', '.join(f"'{space or '/'}'" for space in sorted(spaces))
    text = f"no sensor runs in the namespace '{graph.namespace or '/'}', but in {places}"
    remedy = f'ros2 run nodlidar_bringup doctor --namespace {min(spaces) or "/"}'
    return unknown('no running system', text, remedy)


def _twice(nodes: Sequence[str]) -> list[Finding]:
    return [
        fault(
            'two nodes of one name',
            f"the node '{name}' runs {count} times",
            f'end one of the two systems, or start it with {LAUNCH} namespace:=second',
        )
        for name, count in sorted(Counter(nodes).items())
        if count > 1
    ]


def _mute(names: Sequence[str]) -> list[Finding]:
    return [
        fault('node hangs', f"'{name}' runs, but answers no request: it hangs", START_AGAIN)
        for name in names
    ]


def _inactive(nodes: Mapping[str, bool]) -> list[Finding]:
    return [
        fault(
            'node not active',
            f"'{name}' runs, but is {'finalized' if finalized else 'not active'}, so it publishes "
            'nothing',
            START_AGAIN
            if finalized
            else f'ros2 lifecycle set {name} configure; ros2 lifecycle set {name} activate',
        )
        for name, finalized in nodes.items()
    ]


def _sim_time(graph: Graph) -> list[Finding]:
    if graph.clock_published or not graph.on_sim_time:
        return []
    names = ', '.join(graph.on_sim_time)
    remedy = f'ros2 param set {graph.on_sim_time[0]} use_sim_time false'
    text = f'use_sim_time is set in {names}, and nobody publishes /clock: time stands still there'
    return [fault('no simulated time', text, remedy)]


def _publishers(topic: Topic, full: str, graph: Graph) -> list[Finding]:
    if topic.name not in SOURCES:
        return []
    node = SOURCES[topic.name]
    if not topic.publishers:
        who = 'driver of the lidar' if node == 'driver' else node
        text = f"nobody publishes '{topic.name}': no {who} runs in this namespace"
        start = LAUNCH
        if _has_nodes(graph):  # a launch ends with any of its nodes
            text, start = f'{text}, or it hangs', START_AGAIN
        remedy = f'{start}, and read what the {who} says'
        if node == 'driver':
            remedy += '; with lidar:=... start that driver yourself (docs/lidars.md)'
        return [fault('no publisher', text, remedy)]
    names = [endpoint.node for endpoint in topic.publishers]
    if len(names) > 1 and not (node == 'servo' and graph.other_joints):
        text = f"'{topic.name}' has {len(names)} publishers: {', '.join(names)}"
        remedy = f'ros2 topic info -v {full}; end one, or start it with namespace:=second; '
        remedy += KILLED
        return [fault('two publishers', text, remedy)]
    return []


def _types(topic: Topic, full: str) -> list[Finding]:
    if len(topic.types) < 2:
        return []
    text = f"'{topic.name}' is used with different types: {', '.join(topic.types)}"
    return [fault('types differ', text, f'ros2 topic info -v {full}; remap one of them')]


def _mismatches(topic: Topic, full: str) -> list[Finding]:
    """Return the subscriptions that want more than a publisher offers.

    As in the tables of compatibilities of the ROS 2 documentation, "Quality of Service settings".
    """
    findings = []
    for publisher in topic.publishers:
        for subscription in topic.subscriptions:
            wanted, policies = [], []
            if subscription.reliable and not publisher.reliable:
                wanted.append('reliable messages')
                policies.append('reliability: best_effort')
            if subscription.transient_local and not publisher.transient_local:
                wanted.append('kept messages')
                policies.append('durability: volatile')
            if wanted:
                parameters = [f'qos_overrides.{full}.subscription.{each}' for each in policies]
                text = (
                    f"{subscription.node} hears nothing of '{topic.name}': it wants "
                    f'{" and ".join(wanted)}, which {publisher.node} does not offer'
                )
                remedy = (
                    f'set {" and ".join(parameters)} in the parameters of {subscription.node}, '
                    f'or see ros2 topic info -v {full}'
                )
                findings.append(warning('quality of service', text, remedy))
    return findings

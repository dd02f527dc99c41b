"""Collects the facts and runs the checks of the command doctor."""

from argparse import Namespace
from dataclasses import replace
import math
import os
import sys
import time
from typing import Any

from nodlidar_assembler.clouds.pipeline import LONGEST_SWEEP
from nodlidar_bringup import argument_values
from nodlidar_bringup.checks.ask import ask
from nodlidar_bringup.checks.diagnostics import check_diagnostics
from nodlidar_bringup.checks.finding import fault, Finding, Level, unknown
from nodlidar_bringup.checks.graph import check_graph, Graph, is_running, LIFECYCLE, SOURCES
from nodlidar_bringup.checks.host import check_host
from nodlidar_bringup.checks.host_facts import HostWatch
from nodlidar_bringup.checks.mounting import check_mounting
from nodlidar_bringup.checks.orientation import Mounting, seen_in
from nodlidar_bringup.checks.port_facts import port_facts
from nodlidar_bringup.checks.ports import (
    check_ports,
    LIDAR,
    may_ask,
    Port,
    same_port,
    SERVO,
    ServoSettings,
)
from nodlidar_bringup.checks.report import Section
from nodlidar_bringup.checks.traffic import (
    check_content,
    check_together,
    check_traffic,
    shows_sweep,
    stands_still,
)
from nodlidar_bringup.checks.transforms import check_frames, Frames
from nodlidar_bringup.ros.discovery import announce_often
from nodlidar_bringup.ros.node_settings import inactive, mute, settings_of
from nodlidar_bringup.ros.system_watch import SystemWatch
from nodlidar_common.pose import Pose
import numpy as np
import rclpy
from rclpy.node import Node

DISCOVERY = 3.2  # s, until the running nodes are found: Fast DDS announces itself every 3 s
OTHERS = 1.0  # s, from the first node until all are found
CLOUD_FRAME = 'nodlidar_base_link'  # their frame, without its prefix
JOINT = 'nod_joint'  # without its prefix
ROBOT = 'base_link'  # on the floor; it has no prefix
SWEEPS = 2.5  # to listen for: then one is surely seen from reversal to reversal
MOST_TILTED = 0.5  # rad, of a mount whose cloud still shows floor and walls
_PORTS = {
    LIDAR: ('/dev/nodlidar_lidar', '/dev/ttyACM0'),
    SERVO: ('/dev/nodlidar_servo', '/dev/ttyUSB0'),
}
_SETTINGS = {
    'driver': ('use_sim_time', 'port'),
    'servo': ('use_sim_time', 'port', 'baud_rate', 'servo_id'),
    'assembler': (
        *('use_sim_time', 'frame_id', 'laser_xyz', 'laser_rpy'),
        *('cloud_mode', 'sweeps_per_cloud', 'deadline', 'scan_delay', 'joint_delay'),
    ),
}
_OF_ROS2_CONTROL = ('use_sim_time', 'controller')  # of the node that takes the servo's place
Settings = dict[str, dict[str, Any]]


def examine(options: Namespace) -> list[Section]:
    """Return the findings about ports, computer and running system.

    Parameters
    ----------
    options
        Those of the command.

    Raises
    ------
    ParameterError
        If the namespace or the prefix of frames is not allowed.
    """
    argument_values.check_namespace(options.namespace)
    argument_values.check_frame_prefix(options.frame_prefix or '')
    watch = HostWatch()
    system, settings, running = _examine_system(options)
    ports = _examine_ports(options, settings, running)
    return [
        Section('ports', ports),
        Section('computer', check_host(watch.facts(running is not None))),
        *system,
    ]


def _examine_system(options: Namespace) -> tuple[list[Section], Settings, Graph | None]:
    """Return the findings about the running system, its settings, and its graph, if it runs."""
    announce_often()
    context = rclpy.Context()
    try:
        rclpy.init(context=context)
    except Exception as error:  # a broken environment is what is looked for
        remedy = 'source the setup file of ROS and of this workspace, and see `network` above'
        return [Section('nodes', [fault('ROS does not start', str(error), remedy)])], {}, None
    node = Node(
        'doctor',
        namespace=options.namespace.rstrip('/'),
        context=context,
        enable_rosout=False,
        start_parameter_services=False,
    )
    try:
        return _examine_with(node, options)
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def _examine_with(node: Node, options: Namespace) -> tuple[list[Section], Settings, Graph | None]:
    watch = SystemWatch(node)
    _discover(watch)
    if not is_running(watch.graph()):
        return [Section('nodes', check_graph(watch.graph()))], {}, None
    space = node.get_namespace().rstrip('/')
    running = watch.graph().nodes
    wanted = {f'{space}/{name}': keys for name, keys in _SETTINGS.items()}
    settings = settings_of(node, {name: keys for name, keys in wanted.items() if name in running})
    if settings.get(f'{space}/servo') == {}:  # a node that has not all of them answers with none
        settings |= settings_of(node, {f'{space}/servo': _OF_ROS2_CONTROL})
    # Such as third-party drivers.
    others = [name for name, values in settings.items() if not values]
    settings |= settings_of(node, dict.fromkeys(others, ('use_sim_time',)))
    lifecycle = [name for name in running if name in {f'{space}/{n}' for n in LIFECYCLE}]
    silent = [name for name in wanted if name in running and name not in settings]
    settings = {name.rsplit('/', 1)[-1]: values for name, values in settings.items()}
    lasts = _cloud_lasts(settings.get('assembler', {}), watch.sweep_duration)
    _listen(watch, max(options.seconds, 1.0), lasts)
    on_sim_time = [f'{space}/{n}' for n, v in settings.items() if v.get('use_sim_time')]
    prefix = _prefix(options.frame_prefix, settings.get('assembler', {}))
    graph = replace(
        watch.graph(on_sim_time),
        inactive=inactive(node, lifecycle),
        mute=mute(node, silent),  # once more: a node may have been busy
        other_joints=watch.has_other_joints(f'{prefix}{JOINT}'),
    )
    frames = _frames(watch, prefix, settings)
    messages = _of_messages(watch, lasts, prefix, graph, settings)
    # Clouds of wrong messages do not show the mount.
    wrong = any(finding.level == Level.FAULT for finding in messages)
    return (
        [
            Section('nodes', check_graph(graph)),
            Section('messages', messages),
            Section('transforms', check_frames(frames)),
            Section('mount', [] if wrong else _of_mount(watch, frames, prefix)),
            Section('diagnostics', check_diagnostics(watch.statuses, space)),
        ],
        settings,
        graph,
    )


def _discover(watch: SystemWatch) -> None:
    """Wait until the running nodes are found."""
    deadline = time.monotonic() + DISCOVERY
    while time.monotonic() < deadline:
        watch.listen(0.2)
        if is_running(watch.graph()):
            watch.listen(OTHERS)
            return


def _prefix(given: str | None, assembler: dict[str, Any]) -> str:
    """Return the prefix of the sensor's frames: the given one, or that of the clouds."""
    if given is not None:
        return given
    frame = str(assembler.get('frame_id', ''))
    return frame.removesuffix(CLOUD_FRAME) if frame.endswith(CLOUD_FRAME) else ''


def _cloud_lasts(assembler: dict[str, Any], sweep: float | None) -> float:
    """Return how long a cloud lasts [s]: that of one scan is a moment."""
    if assembler.get('cloud_mode') != 'sweep':
        return 0.0
    sweeps: int = assembler['sweeps_per_cloud']
    return LONGEST_SWEEP if sweep is None else min(sweeps * sweep, LONGEST_SWEEP)


def _listen(watch: SystemWatch, seconds: float, lasts: float) -> None:
    """Listen for some time [s]; for two clouds and a whole sweep, if a nod is commanded."""
    if (sweep := watch.sweep_duration) is not None:
        needed = max(2.0 * lasts, SWEEPS * min(sweep, LONGEST_SWEEP))
        if seconds < needed:
            seconds = needed
            print(f'listening for {seconds:.0f} s: a sweep takes {sweep:.1f} s', file=sys.stderr)
    watch.listen(seconds)


def _stamped_by_clock(graph: Graph) -> set[str]:
    """Return the topics whose node is on simulated time, or another if that does not run.

    Then a bag is played in its place.
    """
    nodes = {topic: f'{graph.namespace}/{node}' for topic, node in SOURCES.items()}
    simulated = graph.on_sim_time
    return {
        topic
        for topic, node in nodes.items()
        if node in simulated or (simulated and node not in graph.nodes)
    }


def _of_messages(
    watch: SystemWatch, lasts: float, prefix: str, graph: Graph, settings: Settings
) -> list[Finding]:
    joint, on_sim_time = f'{prefix}{JOINT}', _stamped_by_clock(graph)
    traffic = {
        name: watch.traffic(name, lasts if name == 'points' else 0.0, name in on_sim_time, joint)
        for name in SOURCES
    }
    findings = [finding for each in traffic.values() for finding in check_traffic(each)]
    assembler = settings.get('assembler', {})
    if 'deadline' in assembler:  # it answered
        waits = assembler['deadline'] + assembler['scan_delay'] - assembler['joint_delay']
        findings += check_together(traffic['scan'], traffic['joint_states'], waits)
    return [*findings, *check_content(watch.content(joint))]


def _frames(watch: SystemWatch, prefix: str, settings: Settings) -> Frames:
    laser = watch.transforms.get(f'{prefix}laser')
    assembler = settings.get('assembler', {}).get('laser_xyz')
    return Frames(
        {child: frozenset(parents) for child, parents in watch.parents.items()},
        tuple(prefix + name for name in Frames().needed),
        watch.traffic('scan').frames,
        None if laser is None else _position(laser),
        None if assembler is None else tuple(assembler),
        any(map(math.isfinite, watch.content(f'{prefix}{JOINT}').positions)),
    )


def _position(transform: Any) -> tuple[float, float, float]:
    place = transform.translation
    return (place.x, place.y, place.z)


def _pose_on_robot(watch: SystemWatch, frame: str) -> Pose | None:
    """Return the pose of a frame on the robot, wherever it is fixed; None if TF lacks it."""
    pose, passed = Pose(np.zeros(3), np.eye(3)), set[str]()
    while frame != ROBOT:
        transform = watch.transforms.get(frame)
        if transform is None or frame in passed:
            return None
        q = transform.rotation
        pose = Pose.from_quaternion(_position(transform), (q.x, q.y, q.z, q.w)) @ pose
        passed.add(frame)
        frame = next(iter(watch.parents[frame]))
    return pose


def _of_mount(watch: SystemWatch, frames: Frames, prefix: str) -> list[Finding]:
    """Return what the cloud says of the mount; nothing if TF lacks it, or turns lidar or roll.

    Nor if the joint stands still: in a single plane, upright walls are not told from leaning ones.
    A part of a sweep may show floor or ceiling alone, as one with the wrong sign does.
    """
    content = watch.content(f'{prefix}{JOINT}')
    if stands_still(content):
        return []
    base, _, laser = frames.needed
    lidar = watch.transforms.get(laser)
    if base not in watch.transforms or lidar is None or abs(lidar.rotation.w) < math.cos(0.05):
        return []
    mount = _pose_on_robot(watch, base)
    if mount is None:
        return [unknown('mount', f"'{base}' is not below '{ROBOT}' in TF: its height is unknown")]
    x, y, z = mount.rotation[2]  # the upward direction, as the sensor has it
    level = math.atan2(-x, abs(z)) * math.copysign(1.0, z)
    if abs(y) > math.sin(0.05) or abs(level) > MOST_TILTED:
        return []
    if not shows_sweep(content):
        remedy = '--seconds of three sweeps: ros2 run nodlidar_bringup doctor --seconds 20'
        return [unknown('mount', 'no whole sweep of the joint was seen', remedy)]
    mounting = Mounting(_position(lidar), float(mount.position[2]), bool(z < 0.0), level)
    try:
        points = watch.points(base)
    except ValueError as error:
        return [fault('points', str(error), 'find who publishes it: `ros2 topic info -v points`')]
    return check_mounting(seen_in(points, mounting), mounting)


def _examine_ports(options: Namespace, settings: Settings, running: Graph | None) -> list[Finding]:
    published = {topic.name for topic in running.topics if topic.publishers} if running else set()
    used = settings.get('driver', {}).get('port')
    given = settings.get('servo', {})
    expected = ServoSettings(
        options.baud_rate or given.get('baud_rate', ServoSettings.baud_rate),
        given.get('servo_id', ServoSettings.servo_id)
        if options.servo_id is None
        else options.servo_id,
    )
    # The ports of a lidar with a third-party driver, and of ros2_control, are none of ours.
    lidar = servo = None
    if used or options.lidar_port or 'scan' not in published:
        lidar = _port(LIDAR, options.lidar_port, used, options, expected)
    of_ours = given.get('port') or options.servo_port or 'joint_states' not in published
    if of_ours and 'controller' not in given:
        servo = _port(SERVO, options.servo_port, given.get('port'), options, expected)
    return check_ports(lidar, servo, expected)


def _port(
    device: str, given: str | None, used: str | None, options: Namespace, servo: ServoSettings
) -> Port:
    """Return the facts about a port; one that nobody uses is asked what is there.

    The port that a node uses may be on another computer, so it is not a fault if it is not here.
    The node itself reports it.
    """
    named, usual = _PORTS[device]
    facts = port_facts(device, given or used or (named if os.path.exists(named) else usual))
    port = replace(facts, chosen=given is not None, own=same_port(facts.path, used or ''))
    if not may_ask(port) or options.no_ask:
        return port
    return replace(port, answer=ask(port, servo.servo_id))

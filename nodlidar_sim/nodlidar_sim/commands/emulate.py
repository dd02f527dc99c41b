"""Emulates lidar and servo on pseudo-terminals, which drivers open like serial ports."""

import argparse
from collections.abc import Sequence
from pathlib import Path
import signal
import sys
import time

from nodlidar_common.command_line import LineParser
from nodlidar_common.ldrobot import LD19
from nodlidar_sim.devices.controlled_joint import ControlledJoint
from nodlidar_sim.devices.driven_lidar import DrivenLidar
from nodlidar_sim.devices.make_devices import (
    CONTROLLED,
    LIDARS,
    make_devices,
    SERVOS,
    WITH_BYTES,
    with_ld19,
)
from nodlidar_sim.devices.other_lidars import OTHER_LIDARS
from nodlidar_sim.devices.servo_models import EMULATED, with_servo
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.world.commanded import CommandedBase
from nodlidar_sim.world.odometry import Base, Odometer
from nodlidar_sim.world.odometry_uncertainty import OdometryUncertainty
from nodlidar_sim.world.scene import load_scene, route_names, Scene, scene_names

_GRACE = 2.0  # for drivers that stop at the same time, to make the devices safe [s]
_WATCH_PERIOD = 0.1  # at which a node without a base checks that the devices run [s]
_LONGEST_TIMEOUT = 3600.0  # of a cmd_vel [s]
_LONGEST_LATENCY = 255.0  # of an FTDI adapter [ms]


def main(argv: Sequence[str] | None) -> int:
    """Run the devices that a command line names; return the exit status."""
    return run(parse(sys.argv[1:] if argv is None else argv))


def without_ros_args(arguments: Sequence[str]) -> list[str]:
    """Return the arguments without those of ROS, which launch adds after ``--ros-args``."""
    kept, ros = [], False
    for argument in arguments:
        if argument == '--ros-args':
            ros = True
        elif not ros:
            kept.append(argument)
        elif argument == '--':
            ros = False
    return kept


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options; exits with one line and status 2 if they are not allowed."""
    parser = LineParser('emulate', __doc__)
    for device in ('lidar', 'servo'):
        text = f'path of the link to the {device} [default: no {device}]'
        parser.add_argument(f'--{device}-link', type=Path, help=text)
    parser.add_argument(
        '--scene',
        default='room',
        help=f'{", ".join(scene_names())} or the path of a YAML file',
    )
    parser.add_argument(
        '--route',
        help=f'{", ".join(route_names())} or the path of a YAML file [default: that of the scene]',
    )
    parser.add_argument(
        '--ideal', action='store_true', help='switch all errors of devices and odometry off'
    )
    parser.add_argument(
        '--base', choices=['route', 'odometry', 'cmd_vel'], default='route',
        help='route: follow the route without publishing odometry; odometry: also publish odom '
        'and its transform, as a node; cmd_vel: follow that topic and publish',
    )  # fmt: skip
    parser.add_argument(
        '--cmd-vel-timeout', type=float, default=0.5, metavar='S',
        help='time for which a cmd_vel is valid [s]',
    )  # fmt: skip
    parser.add_argument('--seed', type=int, default=0, help='seed of all random effects')
    parser.add_argument(
        '--latency-timer', type=float, default=0.0, metavar='MS',
        help="latency timer of the servo's USB adapter [ms]; 16 limits the servo to 62 Hz",
    )  # fmt: skip
    parser.add_argument(
        '--servo-model', choices=SERVOS, default='RX-24F', metavar='MODEL',
        help=f'{", ".join(EMULATED)}; its physics replace those of the scene; {CONTROLLED}: the '
        'servo of the scene as a joint of ros2_control, with a joint_trajectory_controller that '
        'takes joint_trajectory and publishes joint_states, in place of a link',
    )  # fmt: skip
    parser.add_argument(
        '--lidar-model', choices=LIDARS, default='URG-04LX-UG01', metavar='MODEL',
        help=f'{", ".join(WITH_BYTES)}, with the errors of the scene, an LD19 with its own in '
        f'place of those of a URG; {", ".join(OTHER_LIDARS)}: a lidar together with that driver, '
        'which publishes scan, in place of a link',
    )  # fmt: skip
    parser.add_argument(
        '--frame-id',
        default='laser',
        help='frame of the scans of a lidar with a third-party driver',
    )
    parser.add_argument(
        '--joint-name', default='nod_joint', help='name of the joint of ros2_control'
    )
    parser.add_argument(
        '--controller', default='joint_trajectory_controller', help='name of that controller'
    )
    parser.add_argument('--scip11', action='store_true', help='the lidar powers up in SCIP 1.1')
    options = parser.parse_args(without_ros_args(arguments))
    _check(options, parser)
    return options


def _check(options: argparse.Namespace, parser: LineParser) -> None:
    """Exit with one line and status 2 if an option is not allowed."""
    driven = options.lidar_model in OTHER_LIDARS
    controlled = options.servo_model == CONTROLLED
    if driven and options.lidar_link is not None:
        parser.error(f'--lidar-link must not be given: {options.lidar_model} publishes scan')
    if controlled and options.servo_link is not None:
        parser.error(f'--servo-link must not be given: {CONTROLLED} publishes joint_states')
    if not (driven or controlled or options.lidar_link or options.servo_link):
        parser.error('no device to emulate: set --lidar-link, --servo-link or both')
    if not 0.0 < options.cmd_vel_timeout <= _LONGEST_TIMEOUT:
        allowed = f'above 0 and at most {_LONGEST_TIMEOUT:g} s'
        parser.error(f'--cmd-vel-timeout must be {allowed}, but is {options.cmd_vel_timeout}')
    if not 0.0 <= options.latency_timer <= _LONGEST_LATENCY:
        allowed = f'from 0 to {_LONGEST_LATENCY:g} ms'
        parser.error(f'--latency-timer must be {allowed}, but is {options.latency_timer}')
    if options.seed < 0:
        parser.error(f'--seed must be at least 0, but is {options.seed}')


def run(options: argparse.Namespace) -> int:
    """Run the devices with a link until SIGINT or SIGTERM; return the exit status."""
    scene = load_scene(options.scene, options.route or None, ideal=options.ideal)
    if options.servo_model not in ('RX-24F', CONTROLLED):
        scene = with_servo(scene, options.servo_model)
    if options.lidar_model == LD19:
        scene = with_ld19(scene)
    start_ns = time.time_ns()
    base = make_base(options, scene, start_ns)
    devices = make_devices(
        scene,
        start_ns,
        options.seed,
        latency_timer=options.latency_timer / 1e3,
        scip11=options.scip11,
        base=base,
        servo_model=options.servo_model,
        lidar_model=options.lidar_model,
    )
    links = {'lidar': options.lidar_link, 'servo': options.servo_link}
    links = {name: link for name, link in links.items() if link is not None}
    in_ros = [one for one in devices.values() if isinstance(one, DrivenLidar | ControlledJoint)]
    served = {name: one for name, one in devices.items() if name in links or one in in_ros}
    with PseudoTerminals(served, links) as terminals:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: terminals.stop(_GRACE))
        for name in links:
            print(f'{name} ready at {terminals[name]}', flush=True)
        if options.base == 'route' and not in_ros:
            terminals.wait()
            return 0
        odometer = Odometer(base, scene.effects, start_ns, options.seed)
        odometry = odometer, OdometryUncertainty(scene.effects)
        return run_node(options, base, odometry, in_ros, terminals)


def make_base(options: argparse.Namespace, scene: Scene, start_ns: int) -> Base:
    """Return the base selected by the options."""
    if options.base == 'cmd_vel':
        return CommandedBase(scene.base_start, start_ns, options.cmd_vel_timeout)
    return scene.route(start_ns)


def run_node(
    options: argparse.Namespace,
    base: Base,
    odometry: tuple[Odometer, OdometryUncertainty],
    in_ros: Sequence[DrivenLidar | ControlledJoint],
    terminals: PseudoTerminals,
) -> int:
    """Run the simulation's node until a signal, then the devices until their hosts close them."""
    # Imported here, so that the devices can be emulated without ROS.
    from nodlidar_common.ros.node import run as run_until_signal
    from nodlidar_common.ros.steady import create_steady_timer
    from nodlidar_sim.ros.base_node import BaseNode
    from nodlidar_sim.ros.joint_controller import JointController
    from nodlidar_sim.ros.scan_publisher import ScanPublisher
    from rclpy.node import Node

    def watch(node: Node) -> None:
        node.failed = not terminals.running()

    def make_node() -> Node:
        if options.base == 'route':
            node = Node('base')
            create_steady_timer(node, _WATCH_PERIOD, lambda: watch(node))
        else:
            commanded = base if isinstance(base, CommandedBase) else None
            node = BaseNode(*odometry, terminals.clock, terminals.running, commanded)
        for device in in_ros:
            if isinstance(device, DrivenLidar):
                ScanPublisher(node, device, options.frame_id)
            else:
                names = options.controller, options.joint_name
                JointController(node, device, names, terminals.clock)
        return node

    status = run_until_signal(make_node, sys.argv)
    if not terminals.running():  # stopped by an early signal, or an error that their exit raises
        return 0
    terminals.stop(_GRACE)
    terminals.wait()
    return status

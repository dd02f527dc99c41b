"""Run the emulated devices alone, on pseudo-terminals that drivers open like serial ports."""

import argparse
from collections.abc import Sequence
from pathlib import Path
import signal
import sys
import time

from nodlidar_common.command_line import LineParser
from nodlidar_common.command_line import run as run_command
from nodlidar_sim.devices.device import Device
from nodlidar_sim.devices.rx24f import Rx24fEmulator
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.world.commanded import CommandedBase
from nodlidar_sim.world.effects import imperfect
from nodlidar_sim.world.odometry import Base, Odometer
from nodlidar_sim.world.odometry_uncertainty import OdometryUncertainty
from nodlidar_sim.world.scene import load_scene, route_names, Scene, scene_names
from nodlidar_sim.world.servo_motion import ServoMotion
from nodlidar_sim.world.world import World
import numpy as np

_GRACE = 2.0  # for drivers that end with the program, to leave the devices safe [s]
_LONGEST = 3600.0  # [s]
_LATENCY = 255.0  # of an FTDI adapter [ms]
_BAUD_1M = 1  # the register's value for 1 Mbit/s, which the servo of the sensor is set to


def without_ros_args(arguments: Sequence[str]) -> list[str]:
    """Return the arguments without those between ``--ros-args`` and ``--``, which launch adds."""
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
    """Return the options; exits with a line and status 2 if they make no sense."""
    description = 'Emulate the lidar and the servo of a nodding lidar on pseudo-terminals.'
    parser = LineParser('emulate', description)
    parser.add_argument('--lidar-link', type=Path, help='where to link the lidar; none without it')
    parser.add_argument('--servo-link', type=Path, help='where to link the servo; none without it')
    parser.add_argument(
        '--scene', default='room', help=f'{", ".join(scene_names())} or the path of a YAML file'
    )
    parser.add_argument(
        '--route', help=f"in place of the scene's: {', '.join(route_names())} or a YAML file"
    )
    parser.add_argument(
        '--base', choices=['route', 'odometry', 'cmd_vel'], default='route',
        help='route: drives it and tells nobody (default); odometry: also publishes, as a node, '
        'odom and its transform; cmd_vel: drives as that topic says, and publishes',
    )  # fmt: skip
    parser.add_argument(
        '--cmd-vel-timeout', type=float, default=0.5, metavar='S',
        help='how long a cmd_vel holds [s] (default 0.5)',
    )  # fmt: skip
    parser.add_argument('--seed', type=int, default=0, help='of all that is random (default 0)')
    parser.add_argument(
        '--latency-timer', type=float, default=0.0, metavar='MS',
        help="of the servo's USB adapter [ms]; 16 gives 62 Hz (default 0: none)",
    )  # fmt: skip
    parser.add_argument('--scip11', action='store_true', help='the lidar powers up in SCIP 1.1')
    options = parser.parse_args(without_ros_args(arguments))
    if options.lidar_link is None and options.servo_link is None:
        parser.error('nothing to emulate: give --lidar-link, --servo-link or both')
    if not 0.0 < options.cmd_vel_timeout <= _LONGEST:
        allowed = f'above 0 and at most {_LONGEST:g} s'
        parser.error(f'--cmd-vel-timeout must be {allowed}, but is {options.cmd_vel_timeout}')
    if not 0.0 <= options.latency_timer <= _LATENCY:
        allowed = f'from 0 to {_LATENCY:g} ms'
        parser.error(f'--latency-timer must be {allowed}, but is {options.latency_timer}')
    if options.seed < 0:
        parser.error(f'--seed must be at least 0, but is {options.seed}')
    return options


def make_devices(
    scene: Scene,
    start_ns: int,
    seed: int,
    latency_timer: float = 0.0,
    scip11: bool = False,
    base: Base | None = None,
) -> dict[str, Device]:
    """Return the two devices, 'lidar' and 'servo', in a scene.

    Parameters
    ----------
    scene
        What the lidar sees, what moves and what goes wrong.
    start_ns
        Host time at which both are switched on and all that moves leaves its start [ns].
    seed
        Of what goes wrong and of the phase of the lidar's rotation.
    latency_timer
        Of the servo's USB adapter [s].
    scip11
        Whether the lidar powers up in SCIP 1.1.
    base
        Where the base is, if not on the scene's route.
    """
    motion = ServoMotion(jitter=scene.effects.servo_jitter, seed=seed)
    world = World(scene, motion, base, start_ns)
    lidar = UrgEmulator(
        imperfect(world.ranges, scene.effects, seed),
        start_ns=start_ns,
        clock_rate=scene.effects.clock_rate,
        rotation_phase=np.random.default_rng(seed).random(),
        scip11=scip11,
    )
    servo = Rx24fEmulator(motion, baud=_BAUD_1M, latency_timer=latency_timer)
    return {'lidar': lidar, 'servo': servo}


def run(options: argparse.Namespace) -> int:
    """Run the devices that have a link until SIGINT or SIGTERM; return the exit status."""
    scene = load_scene(options.scene, options.route or None)
    start_ns = time.time_ns()
    base = make_base(options, scene, start_ns)
    devices = make_devices(
        scene, start_ns, options.seed, options.latency_timer / 1e3, options.scip11, base
    )
    links = {'lidar': options.lidar_link, 'servo': options.servo_link}
    links = {name: link for name, link in links.items() if link is not None}
    with PseudoTerminals({name: devices[name] for name in links}, links) as terminals:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: terminals.stop(_GRACE))
        for name in links:
            print(f'{name} ready at {terminals[name]}', flush=True)
        if options.base == 'route':
            terminals.wait()
            return 0
        odometer = Odometer(base, scene.effects, start_ns, options.seed)
        return run_node(base, odometer, OdometryUncertainty(scene.effects), terminals)


def make_base(options: argparse.Namespace, scene: Scene, start_ns: int) -> Base:
    """Return the base that the options ask for."""
    if options.base == 'cmd_vel':
        return CommandedBase(scene.base_start, start_ns, options.cmd_vel_timeout)
    return scene.route(start_ns)


def run_node(
    base: Base, odometer: Odometer, uncertainty: OdometryUncertainty, terminals: PseudoTerminals
) -> int:
    """Run the base's node until a signal, and the devices until their hosts have ended, too."""
    # Imported here: without odometry, the devices are emulated where there is no ROS.
    from nodlidar_common.ros.node import run as run_until_signal
    from nodlidar_sim.ros.base_node import BaseNode

    commanded = base if isinstance(base, CommandedBase) else None
    status = run_until_signal(
        lambda: BaseNode(odometer, uncertainty, terminals.clock, terminals.running, commanded),
        sys.argv,
    )
    if not terminals.running():  # by an early signal, or an error that is raised with their exit
        return 0
    terminals.stop(_GRACE)
    terminals.wait()
    return status


def main() -> int:
    """Run as a program; return the exit status."""
    return run_command('emulate', lambda: run(parse(sys.argv[1:])))


if __name__ == '__main__':
    sys.exit(main())

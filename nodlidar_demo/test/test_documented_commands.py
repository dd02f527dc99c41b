"""Commands in the README files and in docs/: run, or at least parsed, with what they name there.

Devices and recordings are emulated; what takes long is only checked: launch, make, bench.
"""

from contextlib import nullcontext
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
import os
from pathlib import Path
import re
import shlex
import signal
import subprocess
import time
from unittest.mock import MagicMock

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext
from nodlidar_assembler.commands.entry_points import assemble_bag, calibrate
from nodlidar_bringup.commands.entry_points import doctor, install_udev_rules
from nodlidar_common.nod import Nod
from nodlidar_demo.commands.demo import parse
from nodlidar_driver.commands.entry_points import probe
from nodlidar_mapper.commands.entry_points import map_bag
from nodlidar_planner.commands.entry_points import plan_scan
from nodlidar_servo.commands.entry_points import setup
from nodlidar_sim.bag import write_bag
from nodlidar_sim.devices.streaming_lidar import StreamingLidar
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.devices.x_servo import XServoEmulator
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
import yaml

WORKSPACE = Path(__file__).parents[2]
PAGES = [
    *(WORKSPACE / name for name in ('README.md', 'CONTRIBUTING.md')),
    *sorted(WORKSPACE.glob('docs/*.md')),
    *sorted(WORKSPACE.glob('nodlidar_*/README.md')),
]
PROGRAMS = r'ros2 (?:run|launch|service call|action send_goal)|make|rosbags-convert|python3? -m'
COMMAND = re.compile(rf'(?:{PROGRAMS}) [^`#]+')
# Programs of others: by test_slam_commands.py of nodlidar_bringup.
OTHERS = re.compile(r'ros2 (?:run|launch) (?!nodlidar_)')
# By test_demo.py, test_demo_mapping.py and test_other_lidars.py of nodlidar_assembler.
RUN_ELSEWHERE = {
    'make demo',
    'make demo-mapping',
    'ros2 run nodlidar_demo demo',
    'rosbags-convert --src tilting.bag --dst tilting',
    'ros2 run nodlidar_assembler assemble_bag tilting tilting.ply --params lidar.yaml',
}


def documented():
    """Return the commands of all pages: lines of code blocks, and code within a sentence."""
    found = set()
    for page in PAGES:
        text = page.read_text().replace('\\\n', '')
        blocks = re.findall(r'^```\n(.*?)^```', text, re.DOTALL | re.MULTILINE)
        lines = [line for block in blocks for line in block.splitlines()]
        lines += re.findall(r'^ {4}(.+)', text, re.MULTILINE)
        prose = re.sub(r'^```.*?^```', '', text, flags=re.DOTALL | re.MULTILINE)
        spans = [' '.join(span.split()) for span in re.findall(r'`([^`]+)`', prose)]
        for text in (*lines, *spans):
            if match := COMMAND.match(text.strip().removeprefix('$ ')):
                found.add(' '.join(match[0].split()))
    return sorted(command for command in found - RUN_ELSEWHERE if not OTHERS.match(command))


COMMANDS = documented()


def starting(*words):
    chosen = [each for each in COMMANDS if shlex.split(each)[: len(words)] == list(words)]
    return pytest.mark.parametrize('command', chosen)


def options(command):
    return shlex.split(command)[4:]


def test_each_is_run_by_a_test():
    tested = [
        mark.args[1]
        for test in globals().values()
        for mark in getattr(test, 'pytestmark', [])
        if mark.name == 'parametrize'
    ]
    assert sorted(command for commands in tested for command in commands) == COMMANDS


@starting('ros2', 'run', 'nodlidar_planner', 'plan_scan')
def test_plan_scan(command):
    refused = '--time-budget' in command  # its page shows the error
    fewer = ['--speed-min', '5.5', '--timing-error', '0']  # nods and runs, to save time
    if not refused and '--max-hole' not in command:
        fewer += ['--top', '1']
    assert plan_scan([*fewer, *options(command)]) == (2 if refused else 0)


@pytest.fixture
def demo_bag(tmp_path, monkeypatch):
    """Return a function that leaves the bag of a scene where the demo leaves its own."""

    def record(scene, duration):
        nod = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, 10**18)
        (tmp_path / 'demo_output').mkdir()
        recording = simulate(load_scene(scene, ideal=True), nod, duration, start_ns=10**18)
        write_bag(recording, tmp_path / 'demo_output' / 'bag')
        monkeypatch.chdir(tmp_path)

    return record


@starting('ros2', 'run', 'nodlidar_assembler', 'assemble_bag')
def test_assemble_bag(command, demo_bag):
    demo_bag('room', 2.0)
    assert assemble_bag(options(command)) == 0


@starting('ros2', 'run', 'nodlidar_assembler', 'calibrate')
def test_calibrate(command, demo_bag):
    demo_bag('room', 1.5)
    assert calibrate(options(command)) == 0


@starting('ros2', 'run', 'nodlidar_mapper', 'map_bag')
def test_map_bag(command, demo_bag):
    demo_bag('corridor', 3.0)
    assert map_bag(options(command)) == 0


@starting('ros2', 'run', 'nodlidar_mapper', 'mapper')
def test_mapper(command):
    runs_until_interrupted(command, 'waiting for clouds')


@starting('ros2', 'run', 'nodlidar_viewer', 'view_bag')
def test_view_bag(command, demo_bag):
    demo_bag('corridor', 2.0)
    runs_until_interrupted(command, 'in a browser')


@starting('ros2', 'launch', 'nodlidar_bringup')
def test_launch(command, monkeypatch):
    file, *arguments = [word for word in shlex.split(command)[3:] if word != '--show-args']
    share = Path(get_package_share_directory('nodlidar_bringup'))
    monkeypatch.chdir(share / 'config' / 'slam')
    spec = spec_from_file_location('launch_file', share / 'launch' / file)
    launch_file = module_from_spec(spec)
    spec.loader.exec_module(launch_file)
    *declared, nodes = launch_file.generate_launch_description().entities
    context = LaunchContext()
    context.launch_configurations.update(word.split(':=') for word in arguments)
    for argument in declared:
        argument.visit(context)
    assert len(context.launch_configurations) == len(declared)
    assert len(nodes.visit(context)) >= 3


@starting('ros2', 'run', 'nodlidar_bringup', 'doctor')
def test_doctor(command, capsys):
    assert doctor(['--no-ask', '--seconds', '1', *options(command)]) in (0, 1)
    assert 'no sensor runs' in capsys.readouterr().out


@starting('ros2', 'run', 'nodlidar_bringup', 'install_udev_rules')
def test_install_udev_rules(command, capsys):
    assert install_udev_rules([*{'--print', *options(command)}]) == 0
    assert 'latency_timer' in capsys.readouterr().out


@starting('ros2', 'service', 'call')
def test_service(command):
    takes_fields(command, 'Request')


@starting('ros2', 'action', 'send_goal')
def test_action(command):
    takes_fields(command, 'Goal')


def takes_fields(command, part):
    """Set the fields of a command's message, which refuses other names and types."""
    *_, name, text = shlex.split(command)
    package, folder, kind = name.split('/')
    interface = getattr(import_module(f'{package}.{folder}'), kind)
    fill(getattr(interface, part)(), yaml.safe_load(text))


def fill(message, fields):
    for name, value in fields.items():
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        else:
            setattr(message, name, value)


@starting('ros2', 'run', 'nodlidar_driver', 'driver')
def test_driver(command):
    runs_until_interrupted(command, 'trying again')


@starting('ros2', 'run', 'nodlidar_driver', 'ldrobot')
def test_ldrobot(command):
    runs_until_interrupted(command, 'trying again')


@starting('ros2', 'run', 'nodlidar_driver', 'probe')
def test_probe(command, monkeypatch, capsys):
    """In virtual time: a busy host is too slow to date scans, and probe says so."""
    clock = VirtualClock(time.time_ns())
    emulator = StreamingLidar if 'LD19' in command else UrgEmulator
    device = emulator(lambda times_ns, azimuth: 3.5 + np.cos(azimuth), start_ns=clock())
    port = VirtualPort(device, clock, 1.0)
    monkeypatch.setattr(port, 'fileno', lambda: -1, raising=False)
    module = 'nodlidar_driver.commands.probe'
    monkeypatch.setattr(f'{module}._opened', lambda options: nullcontext(port))
    monkeypatch.setattr(f'{module}.Guard', MagicMock())
    monkeypatch.setattr(f'{module}.raw_ns', clock)
    assert probe(options(command)) == 0
    assert ('LD19' if 'LD19' in command else 'URG-04LX-UG01') in capsys.readouterr().out


@starting('ros2', 'run', 'nodlidar_servo', 'servo')
def test_servo(command):
    runs_until_interrupted(command, 'trying again')


@starting('ros2', 'run', 'nodlidar_servo', 'setup')
def test_setup(command, tmp_path, capsys):
    servo = XServoEmulator(IdealServo(), baud=3)
    with PseudoTerminals({'servo': servo}) as ports:
        there = ['--port', ports['servo'], '--output', str(tmp_path / 'servo.yaml'), '--yes']
        assert setup([*options(command), *there]) == 0
    shown = capsys.readouterr().out
    assert 'return delay' in shown
    assert f'servo:=XL430-W250 servo_port:={ports["servo"]}' in shown


@starting('ros2', 'run', 'nodlidar_servo', 'joint_trajectory')
def test_joint_trajectory(command):
    runs_until_interrupted(command, 'trying again')


@starting('ros2', 'run', 'nodlidar_sim', 'emulate')
def test_emulate(command, tmp_path):
    if '--help' in command:
        assert subprocess.run(shlex.split(command), capture_output=True).returncode == 0
    else:
        runs_until_interrupted(command.replace('/tmp', str(tmp_path)), 'lidar')


@starting('make')
def test_make(command):
    target, *variables = shlex.split(command)[1:]
    assert re.search(rf'^{target}:', (WORKSPACE / 'Makefile').read_text(), re.MULTILINE)
    for name, value in (variable.split('=', 1) for variable in variables):
        assert f'$({name})' in (WORKSPACE / 'Makefile').read_text()
        if name == 'DEMO_ARGS':
            chosen = parse(shlex.split(value))
            load_scene(chosen.scene, chosen.route, ideal=True)


@starting('python', '-m')
def test_bench(command):
    module, *name = shlex.split(command)[2:]
    folder = WORKSPACE / module.replace('.', '/')
    assert (folder / '__main__.py').exists()
    assert name[0].startswith('--') or list(folder.rglob(f'{name[0]}.py'))


def runs_until_interrupted(command, line):
    """Run a command until it prints a line with some text; an interrupt then ends it well."""
    with subprocess.Popen(
        ['env', '--default-signal=SIGINT', *shlex.split(command)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as process:
        assert any(line in printed for printed in process.stdout)
        os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C
        process.stdout.read()
    assert process.returncode == 0

"""What a launch that is killed leaves behind: no process, no laser, no torque."""

import os
import signal
import subprocess
import sys
import time

from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_sim.devices.make_devices import make_devices
from nodlidar_sim.devices.rx_table import TORQUE_ENABLE
from nodlidar_sim.ports.pseudo_terminals import PseudoTerminals
from nodlidar_sim.world.scene import load_scene
import psutil
import pytest

LONGEST = 30.0  # s; only a failing test waits so long


def wait_until(condition, what):
    deadline = time.monotonic() + LONGEST
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.01)


@pytest.fixture
def nodding(tmp_path):
    """Return a launch whose devices are on, its lidar, and the registers of its servo."""
    devices = make_devices(load_scene('wall', ideal=True), time.time_ns(), seed=0)
    links = {name: tmp_path / name for name in devices}
    lidar, servo = devices['lidar'].sensor, devices['servo'].table
    ports = [f'{name}_port:={link}' for name, link in links.items()]
    with (
        PseudoTerminals(devices, links),
        launched_sensor(tmp_path / 'launch.log', 'hardware:=real', *ports) as running,
    ):
        wait_until(lambda: lidar.laser and servo[TORQUE_ENABLE], 'it does not nod')
        yield running.process, lidar, servo


@pytest.mark.parametrize(
    'victim', ['launch', 'launch of a servo node that is stopped', 'servo', 'all']
)
def test_a_kill_ends_all_nodes_with_torque_and_laser_off(nodding, victim):
    launch, lidar, servo = nodding
    processes = psutil.Process(launch.pid).children(recursive=True)
    nodes = {each.name(): each for each in processes}
    if victim == 'all':
        os.killpg(launch.pid, signal.SIGKILL)
    elif 'launch' in victim:
        if 'stopped' in victim:
            nodes['servo'].send_signal(signal.SIGSTOP)
        launch.kill()
    else:
        nodes[victim].kill()
    wait_until(lambda: not lidar.laser, 'the laser is on')
    wait_until(lambda: not servo[TORQUE_ENABLE], 'the torque is on')
    launch.wait(LONGEST)
    _, left = psutil.wait_procs(processes, LONGEST)
    assert not left


def test_devices_of_nodes_that_are_stopped_are_off_until_these_go_on(nodding):
    launch, lidar, servo = nodding
    os.killpg(launch.pid, signal.SIGSTOP)  # as Ctrl-Z
    wait_until(lambda: not lidar.laser, 'the laser is on')
    wait_until(lambda: not servo[TORQUE_ENABLE], 'the torque is on')
    os.killpg(launch.pid, signal.SIGCONT)
    wait_until(lambda: lidar.laser, 'the laser is off')
    wait_until(lambda: servo[TORQUE_ENABLE], 'the torque is off')


LAUNCHER = """
import pathlib, sys, time
from nodlidar_bringup.ros.launched import launched_sensor
with launched_sensor(pathlib.Path(sys.argv[1])) as running:
    print(running.process.pid, flush=True)
    time.sleep(600)
"""


def test_the_launch_ends_when_who_launched_it_is_killed(tmp_path, monkeypatch):
    """A stand-in for ros2 that runs until it is interrupted."""
    (tmp_path / 'ros2').write_text('#!/bin/sh\nexec sleep 600\n')
    (tmp_path / 'ros2').chmod(0o755)
    monkeypatch.setenv('PATH', f'{tmp_path}:{os.environ["PATH"]}')
    command = [sys.executable, '-c', LAUNCHER, tmp_path / 'launch.log']
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as launcher:
        launch = psutil.Process(int(launcher.stdout.readline()))
        wait_until(lambda: launch.name() == 'sleep', 'the launch does not start')
        launcher.kill()
    try:
        launch.wait(LONGEST)
    except psutil.TimeoutExpired:
        launch.kill()
        raise

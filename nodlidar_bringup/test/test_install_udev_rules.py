"""The rules of udev: its syntax, each adapter that doctor knows, the latency timer, the names."""

from pathlib import Path
import re
import shutil
import subprocess

from nodlidar_bringup.checks.ports import LIDAR_IDS, SERVO_IDS
from nodlidar_bringup.commands.entry_points import install_udev_rules
from nodlidar_bringup.commands.install_udev_rules import commands, install, TARGET
from nodlidar_common.errors import NodlidarError
import pytest

RULES = Path(__file__).parents[1] / 'config' / 'udev' / '60-nodlidar.rules'
# udev(7): keys that match (== !=), and keys that assign (= += -= :=).
MATCHES = r'(ACTION|SUBSYSTEM|KERNEL|DRIVER|ATTRS?\{\w+\})(==|!=)"[^"]*"'
ASSIGNS = r'(SYMLINK|GROUP|MODE|ENV\{\w+\}|ATTR\{\w+\})(=|\+=)"[^"]*"'


def rules():
    lines = RULES.read_text().splitlines()
    return [line for line in lines if line and not line.startswith('#')]


def named(name):
    """Return the USB IDs that get a name."""
    pattern = r'idVendor}=="(\w+)".*idProduct}=="(\w+)".*SYMLINK\+="' + name + '"'
    return {':'.join(match.groups()) for line in rules() if (match := re.search(pattern, line))}


@pytest.mark.parametrize('rule', rules())
def test_each_rule_matches_and_then_assigns(rule):
    assert re.fullmatch(f'({MATCHES}, )+{ASSIGNS}(, {ASSIGNS})*', rule)


def can_verify():
    """Return whether there is a udevadm with `verify`, which systemd has since 254."""
    if not shutil.which('udevadm'):
        return False
    return subprocess.run(['udevadm', 'verify', '--help'], capture_output=True).returncode == 0


@pytest.mark.skipif(not can_verify(), reason='no udev that verifies rules is installed here')
def test_udev_accepts_the_file():
    verified = subprocess.run(['udevadm', 'verify', RULES], capture_output=True, text=True)
    assert verified.returncode == 0, verified.stderr


def test_names_are_those_of_the_devices_that_doctor_knows():
    assert named('nodlidar_lidar') == set(LIDAR_IDS)
    assert named('nodlidar_servo') == set(SERVO_IDS)


def test_the_latency_timer_of_every_ftdi_adapter_is_set():
    rule = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
    assert rule in rules()


def test_the_installed_package_has_the_rules(capsys):
    assert install_udev_rules(['--print']) == 0
    assert capsys.readouterr().out == RULES.read_text()


def test_only_root_does_without_sudo():
    for command in commands(RULES, as_root=False):
        assert command[0] == 'sudo'
    assert ['install', '-m', '644', str(RULES), TARGET] in commands(RULES, as_root=True)


def test_each_command_is_shown_before_it_runs(capfd, monkeypatch, tmp_path):
    (tmp_path / 'sudo').write_text('#!/bin/sh\necho ran "$@"\n')
    (tmp_path / 'sudo').chmod(0o755)
    monkeypatch.setenv('PATH', f'{tmp_path}:/usr/bin:/bin')
    install(RULES, as_root=False)
    lines = capfd.readouterr().out.splitlines()
    for shown, ran in zip(lines[0:6:2], lines[1:6:2], strict=True):
        assert ran == 'ran ' + shown.removeprefix('sudo ')


def test_a_refused_password_is_one_error(monkeypatch, tmp_path):
    (tmp_path / 'sudo').write_text('#!/bin/sh\nexit 1\n')
    (tmp_path / 'sudo').chmod(0o755)
    monkeypatch.setenv('PATH', f'{tmp_path}:/usr/bin:/bin')
    with pytest.raises(NodlidarError, match='not installed'):
        install(RULES, as_root=False)


def test_rules_that_are_installed_but_not_in_effect_are_told_as_such(monkeypatch, tmp_path):
    (tmp_path / 'sudo').write_text('#!/bin/sh\ntest "$1" = install\n')
    (tmp_path / 'sudo').chmod(0o755)
    monkeypatch.setenv('PATH', f'{tmp_path}:/usr/bin:/bin')
    with pytest.raises(NodlidarError, match=r'in effect only after a restart.*udevadm'):
        install(RULES, as_root=False)

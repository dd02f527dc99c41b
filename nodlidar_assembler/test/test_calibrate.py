"""The command calibrate: from a bag to a table and the parameter file."""

from dataclasses import replace
import math
import re

from nodlidar_assembler.calibration.recorded import parameters, start_values
from nodlidar_assembler.commands.entry_points import calibrate
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.nod import Nod
from nodlidar_common.parameter_file import file_values
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

NOD = Nod(-0.61, 0.61, 4001 * 0.1 / 1024, 4001, 10**18)


@pytest.mark.parametrize(
    ('option', 'row'),
    [
        ([], 'elevation is not determined'),
        (['--elevation', '--range-offset'], 'elevation of the beams'),
    ],
)
def test_a_bag_gives_a_file_and_a_table(option, row, tmp_path, monkeypatch, capsys):
    """Delay of 8 ms put in by the stamps; an ideal lidar at its place otherwise."""
    seen = simulate(load_scene('room', ideal=True), NOD, 2.5, start_ns=10**18)
    write_bag(replace(seen, joint_stamp_ns=seen.joint_stamp_ns + 8_000_000), tmp_path / 'bag')
    monkeypatch.chdir(tmp_path)
    assert calibrate(['bag', '--output', 'found here.yaml', *option]) == 0
    values = file_values(['found here.yaml'], 'assembler', AssemblerConfig)
    head = (tmp_path / 'found here.yaml').read_text().splitlines()[2]
    assert head.startswith('# Not determined')
    assert head.endswith(' elevation, offset.') == (not option)
    assert abs(values['joint_delay'] - 0.008) < 0.5e-3
    assert abs(values['laser_rpy'][2]) < math.radians(0.1)
    assert abs(values['beam_elevation']) < math.radians(0.1)
    assert abs(values['range_offset']) < 0.01
    printed = capsys.readouterr().out
    assert 'joint delay' in printed
    assert row in printed
    assert 'RMS thickness' in printed
    assert "calibration:='found here.yaml'" in printed


def test_a_robot_that_moves_is_named(tmp_path, capsys):
    scene = load_scene('room', ideal=True).with_velocity((0.1, 0.0))
    write_bag(simulate(scene, NOD, 1.0, start_ns=10**18), tmp_path / 'bag')
    assert calibrate([str(tmp_path / 'bag'), '--output', str(tmp_path / 'found.yaml')]) == 1
    assert 'the robot moves in this recording, by 0.1' in capsys.readouterr().err


def test_scans_that_are_left_out_are_counted(tmp_path, capsys):
    """Two of ten, which a delay of 0.3 s puts before 1970."""
    scene = load_scene('room', ideal=True).with_velocity((0.1, 0.0))
    write_bag(simulate(scene, NOD, 1.0, start_ns=10**8), tmp_path / 'bag')
    params, output = tmp_path / 'params.yaml', tmp_path / 'found.yaml'
    params.write_text('/**: {ros__parameters: {scan_delay: 0.3}}')
    command = [str(tmp_path / 'bag'), '--params', str(params), '--output', str(output)]
    assert calibrate(command) == 1  # the robot moves
    assert 'dropped: 2 stamp must be after 1970' in capsys.readouterr().err


def test_a_result_that_cannot_be_written_is_refused_before_the_work(tmp_path, capsys):
    """The bag does not exist either, which would be named if it was read first."""
    assert calibrate(['nowhere', '--output', str(tmp_path / 'new' / 'found.yaml')]) == 1
    assert f"No such file or directory: '{tmp_path}/new/found.yaml'" in capsys.readouterr().err


def test_what_is_missing_is_named(capsys):
    assert calibrate(['nowhere']) == 1
    assert "there is no 'nowhere'" in capsys.readouterr().err


def test_a_topic_that_a_bag_lacks_is_named_with_those_that_it_has(tmp_path, capsys):
    seen = simulate(load_scene('room', ideal=True), NOD, 0.5, start_ns=10**18)
    write_bag(seen, tmp_path / 'bag')
    assert calibrate([str(tmp_path / 'bag'), '--scan', 'front']) == 1
    assert 'has no topic /front; it has /joint_states' in capsys.readouterr().err


def test_why_nothing_of_a_bag_can_be_used_is_said(tmp_path, capsys):
    """Scans that a delay puts before 1970, and joint states without a position."""
    seen = simulate(load_scene('room', ideal=True), NOD, 0.5, start_ns=10**8)
    params, unmeasured = tmp_path / 'params.yaml', np.full_like(seen.joint_position, np.nan)
    for delay, recording, said in (
        ('1.0', seen, 'no usable scan: 5 stamp must be after 1970'),
        ('0.0', replace(seen, joint_position=unmeasured), 'too few joint states: .* position'),
    ):
        params.write_text(f'/**: {{ros__parameters: {{scan_delay: {delay}}}}}')
        write_bag(recording, tmp_path / delay)
        command = [str(tmp_path / delay), '--params', str(params)]
        assert calibrate([*command, '--output', str(tmp_path / 'found.yaml')]) == 1
        assert re.search(said, capsys.readouterr().err)


@pytest.mark.parametrize('way', ['up', 'down'])
def test_values_and_parameters_are_the_same(way):
    config = AssemblerConfig(
        joint_positive=way,
        joint_zero=0.03,
        joint_delay=0.004,
        laser_xyz=(0.01, 0.02, 0.09),
        laser_rpy=(0.1, 0.2, 0.3),
        beam_elevation=0.02,
        range_offset=0.01,
    )
    again = parameters(start_values(config), config)
    assert {key: np.ravel(value).tolist() for key, value in again.items()} == {
        key: np.ravel(getattr(config, key)).tolist() for key in again
    }


@pytest.mark.parametrize('seconds', ['0', '601', 'inf', 'nan'])
def test_a_recording_without_end_is_refused(capsys, seconds):
    assert calibrate(['live', '--seconds', seconds]) == 2
    assert "'--seconds' must be above 0 and at most 600 s" in capsys.readouterr().err


@pytest.mark.parametrize('pitch', ['30', 'nan'])
def test_degrees_and_what_is_no_angle_are_refused(capsys, pitch):
    assert calibrate(['live', '--mount-rpy', '0', pitch, '0']) == 2
    assert '--mount-rpy: angles are in radians' in capsys.readouterr().err

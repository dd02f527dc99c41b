"""The demo: what it launches for which scene, and its table of distances."""

from collections import Counter
import errno
import io

from nodlidar_demo.commands.entry_points import demo
from nodlidar_demo.delivery import Delivery
from nodlidar_demo.report import Distances, nod_rows, rms_table
from nodlidar_demo.ros import demonstration
from nodlidar_demo.ros.demonstration import launch_arguments
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
import rclpy
from rich.console import Console


@pytest.mark.parametrize(
    ('scene', 'route', 'expected'),
    [
        ('room', None, []),
        ('crossing', None, ['base:=odometry']),
        ('corridor', None, ['base:=odometry', 'ego_motion:=beam']),
        ('room', 'turn', ['route:=turn', 'base:=odometry', 'ego_motion:=beam']),
    ],
)
def test_only_what_moves_is_told_and_only_a_base_that_drives_is_compensated(
    scene, route, expected
):
    loaded = load_scene(scene, route, ideal=True)
    assert launch_arguments(scene, route, loaded) == [
        f'scene:={scene}',
        *expected,
    ]


def test_the_distances_by_odometry_stand_beside_those_by_true_poses():
    rms, by_odometry = {'ends': 0.03, 'slerp': 0.002}, {'ends': 0.04, 'slerp': 0.025}
    lines = rows(rms_table(Distances(rms, by_odometry=by_odometry)))
    assert ['slerp', '2.0', 'mm', '1.0', 'x', '25.0', 'mm'] in lines
    assert ['ends', '30.0', 'mm', '15.0', 'x', '40.0', 'mm'] in lines
    assert ['ends', '30.0', 'mm', '15.0', 'x'] in rows(rms_table(Distances(rms)))


def test_the_summary_shows_how_the_nod_was_adapted():
    nods = np.array([(-0.61, 0.61, 7547), (-0.4, 0.5, 7547), (-0.35, 0.33, 9435)])
    told = dict(nod_rows(Delivery(np.empty(0), Counter(), 0, 0, nods)))
    assert told['limits of the nod at first'] == '-0.61 to +0.61 rad'
    assert told['limits of the nod at last'] == '-0.35 to +0.33 rad'
    assert told['N_s, first and last'] == '7547, 9435'
    assert told['changes of limits or N_s'] == '2'
    assert nod_rows(Delivery(np.empty(0), Counter(), 0, 0, nods[:0])) == []


def rows(table):
    """Return the words of each line of a table as it is printed."""
    printed = io.StringIO()
    Console(file=printed, width=120).print(table)
    return [line.replace('│', ' ').split() for line in printed.getvalue().splitlines()]


@pytest.mark.parametrize(
    ('arguments', 'status', 'said'),
    [
        (['--duration', 'nan'], 2, "'--duration' must be above 0 and at most 3600 s, but is nan"),
        (['--duration', '0'], 2, 'but is 0.0'),
        (['--scene', 'moon'], 2, "'scene' must be one of building, corner"),
        (['--durat', '3'], 2, '--durat'),
        (['--output', '/dev/null/results'], 1, "Not a directory: '/dev/null/results'"),
    ],
)
def test_what_cannot_be_is_a_line_before_anything_is_started(capsys, arguments, status, said):
    assert demo(arguments) == status
    error = capsys.readouterr().err
    assert error.startswith('demo: error: ')
    assert said in error
    assert error.count('\n') == 1


def test_a_full_disk_is_told_with_the_name_of_the_bag(tmp_path, monkeypatch):
    def full(bag, best_effort):
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(demonstration, 'Recorder', full)
    with pytest.raises(OSError, match='No space left') as caught:
        demonstration.record(tmp_path / 'bag', 1.0, None, Console())
    assert caught.value.filename == str(tmp_path / 'bag')
    assert not rclpy.ok()

"""The demo: what it launches for which scene, and its table of distances."""

import io

from nodlidar_bringup.demonstration import launch_arguments
from nodlidar_bringup.report import rms_table
from nodlidar_sim.scene import load_scene
import pytest
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
    loaded = load_scene(scene, route)
    assert launch_arguments(scene, route, loaded) == [f'scene:={scene}', *expected]


def test_the_distances_by_odometry_stand_beside_those_by_true_poses():
    rms, by_odometry = {'ends': 0.03, 'slerp': 0.002}, {'ends': 0.04, 'slerp': 0.025}
    lines = rows(rms_table(rms, by_odometry))
    assert ['slerp', '2.0', 'mm', '1.0', 'x', '25.0', 'mm'] in lines
    assert ['ends', '30.0', 'mm', '15.0', 'x', '40.0', 'mm'] in lines
    assert ['ends', '30.0', 'mm', '15.0', 'x'] in rows(rms_table(rms, {}))


def rows(table):
    """Return the words of each line of a table as it is printed."""
    printed = io.StringIO()
    Console(file=printed, width=120).print(table)
    return [line.replace('│', ' ').split() for line in printed.getvalue().splitlines()]

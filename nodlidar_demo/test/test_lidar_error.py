"""The part of the demo's distances that is the lidar's own."""

from dataclasses import replace
import math

from nodlidar_common.nod import Nod
from nodlidar_demo.evaluation import lidar_rms, points_of_log, surface_rms
from nodlidar_demo.report import Distances, rms_table
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.scene import load_scene, parse_scene
import pytest

NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, 0)
# Beams from the centre of a ball are normal to it, so that noise is the distance from it.
BALL = parse_scene(
    'sensor: {mount: [0, 0, 0, 0, 0, 0], optical_offset: 0.0}\n'
    'objects: {ball: {shapes: [{sphere: {center: [0, 0, 0], radius: 2}}]}}',
    'ball',
)


def test_in_a_ball_it_is_the_noise():
    scene = replace(BALL, optical_offset=0.08, lidar=LidarParameters(noise=0.01))
    log = simulated_log(simulate(scene, NOD, 3.0))
    assert lidar_rms(log, scene, 0) == pytest.approx(0.01, rel=0.03)


def test_without_errors_it_is_nothing():
    log = simulated_log(simulate(BALL, NOD, 0.5))
    assert lidar_rms(log, replace(BALL, optical_offset=0.08), 0) < 1e-6


def test_estimator_and_lidar_add_up_in_squares():
    """The pitch is wrong as much without noise as with it; both errors are independent."""
    lidar = LidarParameters(noise=0.01)
    room = load_scene('room', ideal=True)
    noisy, ideal = (simulate(replace(room, lidar=each), NOD, 6.0) for each in (lidar, room.lidar))
    log = simulated_log(noisy)
    whole, alone = (
        surface_rms(points_of_log(simulated_log(one), 'ends'), one.world) for one in (noisy, ideal)
    )
    own = lidar_rms(log, noisy.world.scene, 0)
    assert math.hypot(own, alone) == pytest.approx(whole, rel=0.05)


def test_mixed_pixels_are_left_out_on_demand():
    """A spot is on the edge of an object and the wall behind it: a point between both."""
    room = load_scene('room', ideal=True)
    scene = replace(room, lidar=LidarParameters(divergence=0.01))
    log = simulated_log(simulate(scene, NOD, 4.0))
    assert lidar_rms(log, scene, 0, mixed_pixel_angle=0.2) < 0.5 * lidar_rms(log, scene, 0)


def test_the_table_states_the_errors_of_the_lidar():
    filtered = {'slerp': 0.013, 'ends': 0.005}
    table = rms_table(Distances({'slerp': 0.03, 'ends': 0.04}, filtered, lidar=0.012))
    assert list(table.columns[-1].cells) == ['13.0 mm', '5.0 mm']
    assert '12.0 mm' in str(table.caption)

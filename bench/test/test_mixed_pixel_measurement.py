from dataclasses import replace

from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.device_section import load_lidar
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.scene import parse_scene
import numpy as np
import pytest

from bench.errors.edge_scenes import drawn_room, shipped_scenes
from bench.errors.mixed_pixels import (
    counted,
    LIDARS,
    LOST,
    mixed_pixels,
    NODDING,
    removed_points,
    STILL,
    still,
)
from bench.shared.reference import START_NS

# The upright edge of a screen at 1.5 m, before a wall at 3 m.
EDGE = parse_scene(
    """objects:
  wall: {shapes: [{plane: {point: [3, 0, 1], normal: [1, 0, 0]}}]}
  screen: {shapes: [{box: {pose: [1.55, 5, 1, 0, 0, 0], size: [0.1, 10, 20]}}]}
""",
    'edge',
)


def test_mixed_pixels_are_those_between_the_surfaces_at_the_edge():
    """The spot, of 10 mrad, covers the edge at step 384 only; steps are 6.1 mrad apart."""
    lidar = LidarParameters(divergence=0.01, noise=0.004)
    seen, spot = (
        simulate(replace(EDGE, lidar=each), still(0.0), 1.0, start_ns=START_NS)
        for each in (lidar, LidarParameters(divergence=0.01))
    )
    steps = np.unique(np.nonzero(mixed_pixels(seen, spot, lidar))[1]) + seen.sensor.first_step
    assert steps.tolist() == [384]
    mixed = mixed_pixels(seen, spot, lidar)
    assert (seen.ranges[mixed] > 1.5).all()
    assert (seen.ranges[mixed] < 3.0).all()
    assert removed_points(seen)[mixed].all()


@pytest.mark.parametrize('lidar', LIDARS)
@pytest.mark.parametrize('nod', [NODDING, STILL])
def test_the_filter_reaches_its_aim(lidar, nod):
    """Four fifths of the mixed pixels and 2 % of the others, in rooms that nobody chose."""
    scenes = [*shipped_scenes()[:1], *(drawn_room(seed) for seed in (101, 102, 103))]
    counts = [counted(scene, load_lidar(lidar), nod) for scene in scenes]
    total = sum(counts[1:], counts[0])
    assert total.mixed > 100
    assert total.mixed_removed >= 0.8 * total.mixed
    assert all(count.row()[LOST] <= 2.0 for count in counts)


def test_no_point_of_a_wall_is_a_mixed_pixel():
    lidar = load_lidar('urg_04lx')
    wall = parse_scene('objects: {w: {shapes: [{plane: {point: [2,0,1], normal: [1,0,0]}}]}}', 'w')
    assert counted(wall, lidar, NODDING).mixed == 0

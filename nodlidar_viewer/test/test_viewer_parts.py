"""What the page is made of, without ROS and browsers."""

import io
import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.point_layout import MOVED_POINT
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_viewer import words
from nodlidar_viewer.choosing import samples_for
from nodlidar_viewer.colours import HeightColours, of_age
from nodlidar_viewer.directions import Directions, STEP
from nodlidar_viewer.fan import EVERY, fan
from nodlidar_viewer.point_file import ply_bytes
from nodlidar_viewer.recent_points import CHUNK_NS, RecentPoints
from nodlidar_viewer.replay import Replay
from nodlidar_viewer.robot_model import RobotModelError, shapes_of
import numpy as np
from plyfile import PlyData
import pytest

URDF = """<robot name="r">
  <material name="blue"><color rgba="0 0 1 1"/></material>
  <link name="base"/>
  <link name="box"><visual><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>
    <geometry><box size="1 2 3"/></geometry><material name="blue"/></visual></link>
  <link name="mesh"><visual><geometry><mesh filename="a.stl"/></geometry></visual></link>
  <link name="round">
    <visual><geometry><cylinder radius="1" length="2"/></geometry></visual>
    <visual><geometry><sphere radius="4"/></geometry></visual></link>
  <joint name="a" type="fixed"><parent link="base"/><child link="box"/></joint>
  <joint name="b" type="fixed"><parent link="base"/><child link="round"/></joint>
  <joint name="c" type="fixed"><parent link="base"/><child link="mesh"/></joint>
</robot>"""


@given(
    sizes=st.lists(st.integers(0, 50), max_size=30),
    gaps=st.lists(st.integers(0, 2 * CHUNK_NS), min_size=30, max_size=30),
    most=st.integers(1, 200),
)
def test_the_latest_points_are_kept(sizes, gaps, most):
    recent, stamp_ns, all_points = RecentPoints(most), 0, np.empty((0, 3), dtype=np.float32)
    for number, (size, gap) in enumerate(zip(sizes, gaps, strict=False)):
        stamp_ns += gap
        points = np.full((size, 3), number, dtype=np.float32)
        all_points = np.concatenate([all_points, points])
        recent.add(stamp_ns, points)
        kept = recent.points
        np.testing.assert_array_equal(kept, all_points[len(all_points) - len(kept) :])
        assert recent.count <= most or len(recent.chunks) == 1
        numbers = [chunk.number for chunk in recent.chunks]
        assert numbers == sorted(set(numbers))


def test_time_that_goes_back_begins_anew():
    recent = RecentPoints(1000)
    recent.add(10 * CHUNK_NS, np.zeros((5, 3), dtype=np.float32))
    recent.add(0, np.ones((7, 3), dtype=np.float32))
    assert recent.points.tolist() == np.ones((7, 3)).tolist()


def test_colours_stay_until_heights_move():
    colours = HeightColours()
    heights = np.linspace(0.0, 3.0, 301, dtype=np.float32)
    assert colours.fit(heights)
    assert not colours.fit(heights + 0.3)
    assert colours.fit(heights + 1.0)
    low, high = colours.of(np.array([-9.0, 9.0], dtype=np.float32)).astype(int)
    assert low[2] > low[0]  # blue below
    assert high[0] > high[2]  # red above
    assert of_age(0.0) != of_age(1.0)
    assert not colours.fit(np.empty(0, dtype=np.float32))


def test_directions_lie_where_the_points_are():
    directions = Directions()
    beyond = [[1.0, 0.0, 1.75], [1.0, 0.0, -9.0]]  # elevations of 60.3 and -84 degrees
    points = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 1.0], *beyond]
    directions.add(0, np.array(points, dtype=np.float32))
    picture = directions.picture()
    rows, columns, _ = picture.shape
    middle, left, right = columns // 2, columns // 4, 3 * columns // 4
    horizon, up = rows // 2, rows // 2 - round(np.radians(45.0) / STEP)
    seen = np.argwhere(picture[:, :, 1] > 200)
    for row, column in ((horizon, middle), (horizon, left), (up, right)):
        assert np.abs(seen - (row, column)).max(axis=1).min() <= 1
    assert len(seen) == 3
    directions.add(20 * 10**9, np.empty((0, 3), dtype=np.float32))
    assert not (directions.picture()[:, :, 1] > 200).any()


def test_the_fan_has_an_area_between_beams_that_hit():
    ranges = [2.0, np.inf, 2.0, 2.0, np.nan, 0.001, 2.0, 65.533]  # the last is a code
    ranges = np.array(ranges, dtype=np.float32).repeat(EVERY)
    vertices, triangles = fan(ranges, -0.5, 0.1, 0.02, 5.6)
    centre, one, other = np.moveaxis(vertices[triangles], 1, 0)
    area = np.linalg.norm(np.cross(one - centre, other - centre), axis=1)
    assert triangles[area > 0.0].tolist() == [[0, 3, 4]]
    np.testing.assert_array_equal(fan(ranges + 1.0, -0.5, 0.1, 0.02, 5.6)[1], triangles)
    angle = -0.5 + 0.1 * 2 * EVERY
    np.testing.assert_allclose(vertices[3], [2 * np.cos(angle), 2 * np.sin(angle), 0], rtol=1e-6)
    assert np.isfinite(vertices).all()


def test_beams_without_an_azimuth_are_in_the_centre_of_the_fan():
    vertices, _ = fan(np.full(9, 2.0, np.float32), math.nan, 0.1, 0.02, 5.6)
    assert not vertices.any()


def test_shapes_of_a_robot_model():
    shapes = shapes_of(URDF)
    assert [(s.link, s.kind, s.size) for s in shapes] == [
        ('box', 'box', (1.0, 2.0, 3.0)),
        ('round', 'cylinder', (1.0, 2.0)),
        ('round', 'sphere', (4.0,)),
    ]
    box = shapes[0]
    assert box.colour == (0.0, 0.0, 1.0)
    np.testing.assert_allclose(box.pose.to_parent(np.eye(3)[:1]), [[0.0, 1.0, 1.0]], atol=1e-9)


@pytest.mark.parametrize('text', ['', '<robot', '<a/>', '<robot name="r"><link/></robot>'])
def test_what_is_no_robot_model(text):
    with pytest.raises(RobotModelError, match='robot_description'):
        shapes_of(text)


def test_states_in_words():
    statuses = [
        words.Status('servo: device', 0, 'fine', 10.0),
        words.Status('driver: device', 2, 'no port', 10.0),
        words.Status('assembler: clouds', 1, '2 dropped', 3.0),
    ]
    assert words.diagnostics(statuses, 10.5).split('\n\n') == [
        '**assembler: clouds**: STALE, nothing heard for 8 s',
        '**driver: device**: ERROR, no port',
        '**servo: device**: fine',
    ]
    evil = words.Status('a_b', 0, 'x < 3, <iframe srcdoc="y"/>\n\n# [*](z) & `', 10.0)
    assert words.diagnostics([evil], 10.0) == (
        r'**a\_b**: x \< 3, \<iframe srcdoc="y"/\> # \[\*\](z) \& \`'
    )
    assert '| points | 9.5 |' in words.rates({'points': 19}, 2.0)
    assert 'no hole' in words.coverage(1.0, 0.0, 10.0, 0.05)
    assert '5.7°' in words.coverage(0.5, 0.1, 10.0, 0.05)


def test_the_saved_file_is_read_by_others():
    points = np.random.default_rng(0).normal(size=(100, 3)).astype(np.float32)
    ply = PlyData.read(io.BytesIO(ply_bytes(points, 'odom')))
    read = np.stack([ply['vertex'][axis] for axis in 'xyz'], axis=1)
    np.testing.assert_array_equal(read, points)
    assert 'frame odom' in ply['vertex'].comments


def cloud_at(seconds):
    data = np.zeros(5, dtype=MOVED_POINT)
    data['x'] = seconds
    stamp_ns = 10**18 + round(seconds * 1e9)
    return Points(np.full(5, stamp_ns), data)


@given(st.lists(st.floats(0.0, 30.0), max_size=10))
def test_a_recording_moved_anywhere_shows_what_was_seen_till_then(instants):
    replay = Replay([cloud_at(second) for second in range(30)], 10_000)
    assert replay.duration == 29.0
    for instant in instants:
        replay.move_to(instant)
        shown = set(replay.recent.points[:, 0].tolist())
        expected = {float(s) for s in range(30) if instant - 10.0 + 1e-6 < s <= instant - 1e-6}
        assert expected <= shown
        assert max(shown) <= instant


@pytest.mark.parametrize('pitch_max', [0.211, 0.751])
def test_any_limits_have_an_n_s_that_is_coprime(pitch_max):
    """Candidates at a whole even distance would all be even, as those of these spans are."""
    config = NodConfig(pitch_min=-0.3, pitch_max=pitch_max)
    assert math.gcd(samples_for(config), 1024) == 1


def test_of_nods_that_all_find_the_object_as_soon_the_page_chooses_the_slowest():
    config = NodConfig(pitch_min=-0.0175, pitch_max=0.0175)
    fewest = config.fewest_samples(config.task.span, config.task.beam_period)
    assert samples_for(config) > 3.9 * fewest

"""Level scans as messages: of the running node, and of `assemble_bag` with the same recording."""

from dataclasses import replace

from bags import entries_of, NOD, recording, write_bag
from node_bench import bench
from nodlidar_assembler.bags.bag_topics import Topics
from nodlidar_assembler.bags.write_clouds import write_clouds
from nodlidar_assembler.clouds.level_ranges import LevelScanConfig
from nodlidar_assembler.commands.entry_points import assemble_bag
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.bag_messages import STORE
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import time_ns
from nodlidar_sim.bag import TOPICS
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
from rclpy.qos import qos_profile_sensor_data
from rclpy.serialization import deserialize_message
from rclpy.time import Time
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState, LaserScan
from tf2_ros import Buffer, TransformListener
from transforms3d.quaternions import quat2mat

KINDS = {'/scan': LaserScan, '/joint_states': JointState}
SHAPE = ('angle_min', 'angle_max', 'angle_increment', 'time_increment', 'scan_time')
RANGE = ('range_min', 'range_max')


@pytest.fixture(scope='module')
def simulated():
    return recording(2.5)


def written(simulated, folder, mode, tilt=(0.0, 0.0)):
    """Return the level scans, and the fixed transforms, that assemble_bag writes."""
    write_bag(simulated, folder / 'bag')
    output, params = folder / 'out.mcap', folder / 'params.yaml'
    params.write_text(f'/**: {{ros__parameters: {{mount_tilt: {list(tilt)}}}}}')
    options = ['--level-scan', mode, '--params', str(params)]
    assert assemble_bag([str(folder / 'bag'), str(output), *options]) == 0
    found = {'/level_scan': [], '/tf_static': [], '/points': []}
    with AnyReader([output]) as reader:
        for kind, _, raw in reader.messages():
            found[kind.topic].append(reader.deserialize(raw, kind.msgtype))
    transforms = [each for message in found['/tf_static'] for each in message.transforms]
    return found['/level_scan'], transforms


@pytest.fixture(params=['sweep', 'scan'])
def of_bag(request, simulated, tmp_path):
    """Return the mode, and the level scans that assemble_bag writes."""
    return request.param, written(simulated, tmp_path, request.param)[0]


def test_the_node_publishes_the_level_scans_of_the_bag(simulated, of_bag):
    mode, expected = of_bag
    assert len(expected) >= (4 if mode == 'sweep' else 12)
    found = []
    with bench(f'level_scan:={mode}', 'deadline:=10.0', 'command_nod:=false') as running:
        running.feeder.create_subscription(
            LaserScan, 'level_scan', found.append, qos_profile_sensor_data
        )
        [topic] = [p for p in running.node.publishers if p.topic_name == '/level_scan']
        running.spin_until_heard(topic)
        for _, name, message in entries_of(simulated):
            if name in KINDS:
                raw = bytes(STORE.serialize_cdr(message, TOPICS[name]))
                publisher = running.scans if name == '/scan' else running.states
                running.send(publisher, deserialize_message(raw, KINDS[name]))
        running.spin_until(lambda: len(found) >= len(expected))
    for one, other in zip(found, expected, strict=True):
        assert time_ns(one.header.stamp) == time_ns(other.header.stamp)
        assert one.header.frame_id == other.header.frame_id == 'nodlidar_base_link'
        for key in SHAPE + RANGE:
            assert getattr(one, key) == pytest.approx(getattr(other, key))
        np.testing.assert_array_equal(one.ranges, other.ranges)


TILT = (0.1, 0.3)  # of a sensor that looks down, and a little to its side [rad]


@pytest.fixture(scope='module')
def tilted():
    """Return what a sensor records that is tilted, and turned by 0.5 rad."""
    mount = Pose.from_xyzrpy((0.0, 0.0, 1.0, *TILT, 0.5))
    return simulate(replace(load_scene('room', ideal=True), mount=mount), NOD, 2.5)


@pytest.mark.parametrize(('told', 'least', 'most'), [(TILT, 0.98, 1.0), ((0.0, 0.0), 0.0, 0.8)])
def test_of_a_tilted_sensor_ranges_are_level(tilted, tmp_path, told, least, most):
    """A surface of the room is where they end, at some height of the band."""
    scans, _ = written(tilted, tmp_path, 'sweep', told)
    near = []
    for scan in scans:
        hit = np.isfinite(scan.ranges)
        azimuth = scan.angle_min + scan.angle_increment * np.flatnonzero(hit) + 0.5
        x, y = scan.ranges[hit] * np.cos(azimuth), scan.ranges[hit] * np.sin(azimuth)
        off = [
            tilted.world.scene.surfaces.surface_distance(
                np.stack([x, y, np.full_like(x, height)], axis=1)
            )
            for height in np.arange(0.1, 2.0, 0.05)
        ]
        near += (np.min(off, axis=0) < 0.06).tolist()
    assert len(near) > 500
    assert least <= np.mean(near) <= most


def test_the_level_frame_of_a_tilted_sensor_is_on_tf(tilted, tmp_path):
    """Seen from base_link, it is turned by the mount's yaw alone."""
    scans, transforms = written(tilted, tmp_path, 'sweep', TILT)
    assert {scan.header.frame_id for scan in scans} == {'nodlidar_base_link_level'}
    with bench('level_scan:=sweep', f'mount_tilt:={list(TILT)}', 'command_nod:=false') as running:
        buffer = Buffer()
        listener = TransformListener(buffer, running.feeder)
        frames = 'nodlidar_base_link', 'nodlidar_base_link_level'
        running.spin_until(lambda: buffer.can_transform(*frames, Time()))
        of_node = buffer.lookup_transform(*frames, Time())
        listener.unregister()
    for transform in (*transforms, of_node):
        assert (transform.header.frame_id, transform.child_frame_id) == frames
        q = transform.transform.rotation
        mount = Pose.from_xyzrpy((0.0, 0.0, 0.0, *TILT, 0.5)).rotation
        level = mount @ quat2mat([q.w, q.x, q.y, q.z])
        turned = [[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]]
        np.testing.assert_allclose(level, turned, atol=1e-9)


def test_a_level_scan_has_as_many_beams_as_its_angles_say(of_bag):
    """As slam_toolbox counts them, by whose count a scan is refused."""
    for scan in of_bag[1]:
        beams = round((scan.angle_max - scan.angle_min) / scan.angle_increment) + 1
        assert beams == len(scan.ranges) == LevelScanConfig().level_scan_beams
        seen = scan.ranges[np.isfinite(scan.ranges)]
        assert len(seen)
        assert (seen <= scan.range_max).all()


def test_a_file_that_holds_no_level_scans_says_so(simulated, tmp_path):
    write_bag(simulated, tmp_path / 'bag')
    config = AssemblerConfig(level_scan='sweep')
    summary = write_clouds(tmp_path / 'bag', tmp_path / 'out.ply', config, Topics())
    assert any('level scans are left out' in note for note in summary.notes)
    assert 'level scans' not in summary.counts

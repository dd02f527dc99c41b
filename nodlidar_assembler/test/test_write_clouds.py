"""Clouds of bags: against the pipeline, the simulator's truth, and independent readers."""

from collections import Counter
from dataclasses import replace
from itertools import product
import math
import subprocess
import sys

from bags import entries_of, recording, START_NS, write_bag, write_messages
from nodlidar_assembler.bags.bag_topics import BagError, Topics
from nodlidar_assembler.bags.point_files import OutputError
from nodlidar_assembler.bags.read_bag import read_bag, with_odometry
from nodlidar_assembler.bags.sensor_log import assemble_log
from nodlidar_assembler.bags.write_clouds import write_clouds
from nodlidar_assembler.clouds.point_layout import xyz_in
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.scan_assembler import ONE_INSTANT
from nodlidar_common.stamps import time_ns
import numpy as np
from plyfile import PlyData
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin

TOPICS = Topics()


@pytest.fixture(scope='module')
def simulated():
    return recording(4.0)


@pytest.fixture(scope='module')
def driving():
    return recording(4.0, velocity=(0.4, 0.5))


@pytest.fixture
def bag(simulated, tmp_path):
    write_bag(simulated, tmp_path / 'bag')
    return tmp_path / 'bag'


@pytest.fixture
def driving_bag(driving, tmp_path):
    write_bag(driving, tmp_path / 'bag')
    return tmp_path / 'bag'


def clouds_in(path):
    """Return the PointCloud2 messages of an MCAP file: time recorded, message, points."""
    found = []
    with AnyReader([path]) as reader:
        for connection, recorded_ns, raw in reader.messages():
            if connection.topic != '/points':
                continue
            message = reader.deserialize(raw, connection.msgtype)
            kinds = {7: np.float32, 4: np.uint16}
            layout = np.dtype(
                {
                    'names': [field.name for field in message.fields],
                    'formats': [kinds[field.datatype] for field in message.fields],
                    'offsets': [field.offset for field in message.fields],
                    'itemsize': message.point_step,
                }
            )
            found.append((recorded_ns, message, np.frombuffer(message.data, layout)))
    return found


def pcd_in(path):
    """Return the points of a binary PCD file, read by the format's description."""
    data = path.read_bytes()
    head, body = data.split(b'DATA binary\n', 1)
    lines = (line.split() for line in head.decode().splitlines() if not line.startswith('#'))
    header = {line[0]: line[1:] for line in lines}
    assert header['VERSION'] == ['0.7']
    assert header['HEIGHT'] == ['1']
    assert header['WIDTH'] == header['POINTS']
    kinds = {'F': 'f', 'U': 'u'}
    sizes = zip(header['TYPE'], header['SIZE'], strict=True)
    formats = [f'<{kinds[kind]}{size}' for kind, size in sizes]
    points = np.frombuffer(body, list(zip(header['FIELDS'], formats, strict=True)))
    assert len(points) == int(header['POINTS'][0])
    return points


def of_pipeline(bag, config):
    """Return what the pipeline makes of the bag read as a whole."""
    log = read_bag(bag, AssemblerConfig())
    if config.ego_motion != 'off':
        log = with_odometry(log, bag, config)
    return assemble_log(log, config)


def assert_continues(last, cloud):
    """Assert that the last cloud has what was seen since a cloud ended."""
    _, message, points = last
    begin_s = (time_ns(message.header.stamp) - cloud.time_ns[-1]) / 1e9
    assert len(points) > 100
    if 'time' in points.dtype.names:
        assert 0.0 < begin_s < 0.05
        assert points['time'][0] == 0.0


@pytest.mark.parametrize(
    ('estimator', 'cloud_mode', 'ego_motion'),
    [
        *((estimator, 'scan', 'off') for estimator in ('nearest', 'ends', 'trajectory')),
        *(('slerp', *modes) for modes in product(('scan', 'sweep'), ('off', 'beam', 'deskew'))),
        ('trajectory', 'sweep', 'deskew'),
    ],
)
def test_they_are_the_pipeline_s(driving_bag, tmp_path, estimator, cloud_mode, ego_motion):
    config = AssemblerConfig(estimator=estimator, cloud_mode=cloud_mode, ego_motion=ego_motion)
    expected, drops = of_pipeline(driving_bag, config)
    summary = write_clouds(driving_bag, tmp_path / 'out.mcap', config, TOPICS)
    found = clouds_in(tmp_path / 'out.mcap')
    if cloud_mode == 'sweep':
        assert_continues(found.pop(), expected[-1])
    assert len(found) == len(expected) > 0
    # At either end the log as a whole lacks the same joint states and odometry, called otherwise.
    assert summary.assembler.drops.total() == drops.total()
    frame = 'odom' if ego_motion == 'beam' else 'nodlidar_base_link'
    for (recorded_ns, message, points), cloud in zip(found, expected, strict=True):
        assert message.header.frame_id == frame
        stamp_ns = cloud.time_ns[-1 if ego_motion == 'deskew' else 0]
        assert time_ns(message.header.stamp) == stamp_ns
        assert recorded_ns >= cloud.time_ns[-1]
        assert points.dtype.names == cloud.data.dtype.names
        for name in points.dtype.names:
            if name in 'xyz' and ego_motion != 'off':
                np.testing.assert_allclose(points[name], cloud.data[name], atol=2e-6)
            else:
                np.testing.assert_array_equal(points[name], cloud.data[name])


@pytest.mark.parametrize('sweeps_per_cloud', [1, 2, 3, 20])
def test_clouds_of_sweeps_have_the_points_of_all_scans(bag, tmp_path, sweeps_per_cloud):
    """The recording ends within a sweep; with 20 there is no whole cloud."""
    points = [
        write_clouds(bag, tmp_path / f'{number}.ply', config, TOPICS).counts['points']
        for number, config in enumerate(
            (
                AssemblerConfig(),
                AssemblerConfig(cloud_mode='sweep', sweeps_per_cloud=sweeps_per_cloud),
            )
        )
    ]
    assert points[0] == points[1] > 20_000


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_points_lie_on_the_true_surfaces(simulated, tmp_path, storage):
    write_bag(simulated, tmp_path / 'bag', storage)
    config = AssemblerConfig(estimator='trajectory')
    summary = write_clouds(tmp_path / 'bag', tmp_path / 'out.ply', config, TOPICS)
    points = PlyData.read(tmp_path / 'out.ply')['vertex'].data
    assert len(points) == summary.counts['points'] > 20_000
    near = xyz_in(points)[np.linalg.norm(xyz_in(points), axis=1) < 3.0]
    [times_ns] = START_NS + np.zeros((1, len(near)), dtype=np.int64)
    distance = simulated.world.surface_distance(near, times_ns)
    assert np.sqrt(np.mean(distance**2)) < 1.5e-3


def test_points_of_a_robot_that_drives_lie_on_the_true_surfaces_in_odom(
    driving, driving_bag, tmp_path
):
    config = AssemblerConfig(estimator='trajectory', ego_motion='beam')
    write_clouds(driving_bag, tmp_path / 'out.pcd', config, TOPICS)
    xyz = xyz_in(pcd_in(tmp_path / 'out.pcd'))
    (x, y, yaw), *_ = driving.world.base.poses(driving.odometry_stamp_ns[:1])
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    in_world = xyz @ turn.T + np.array([x, y, 0.0])
    near = np.linalg.norm(xyz, axis=1) < 3.0
    distance = driving.world.scene.surfaces.surface_distance(in_world[near])
    assert np.sqrt(np.mean(distance**2)) < 2.5e-3


@pytest.mark.parametrize('extra', [(), ('sigma',)])
def test_ply_pcd_and_mcap_hold_the_same_points(bag, tmp_path, extra):
    config = AssemblerConfig(cloud_mode='sweep', sigma_field=bool(extra))
    for name in ('out.ply', 'out.pcd', 'out.mcap'):
        write_clouds(bag, tmp_path / name, config, TOPICS)
    ply, pcd = PlyData.read(tmp_path / 'out.ply')['vertex'].data, pcd_in(tmp_path / 'out.pcd')
    found = clouds_in(tmp_path / 'out.mcap')
    points = np.concatenate([points for _, _, points in found])
    first_ns = time_ns(found[0][1].header.stamp)
    since = np.concatenate(
        [p['time'] + (time_ns(m.header.stamp) - first_ns) / 1e9 for _, m, p in found]
    )
    assert ply.dtype.names == pcd.dtype.names == (*points.dtype.names,)
    for name in ('x', 'y', 'z', 'intensity', 'ring', *extra):
        np.testing.assert_array_equal(ply[name], points[name])
        np.testing.assert_array_equal(pcd[name], points[name])
    np.testing.assert_array_equal(ply['time'], pcd['time'])
    np.testing.assert_allclose(ply['time'], since, atol=1e-6)
    comments = '\n'.join(PlyData.read(tmp_path / 'out.ply').comments)
    assert 'frame nodlidar_base_link' in comments
    assert f'since {first_ns} ns' in comments
    # Open3D passes over what is called ushort.
    assert b'property uint16 ring\n' in (tmp_path / 'out.ply').read_bytes()[:1024]


def test_what_is_malformed_is_counted_and_the_rest_is_read(simulated, tmp_path):
    entries = entries_of(simulated)
    scans = [message for _, topic, message in entries if topic == '/scan']
    states = [message for _, topic, message in entries if topic == '/joint_states']
    scans[3].angle_increment = math.nan
    scans[5].ranges = np.zeros(0, dtype=np.float32)
    scans[7].header.stamp.sec = -1
    states[30].position[0] = math.nan
    entries.insert(60, (entries[60][0], '/scan', b'\x00\x01\x00\x00'))
    bag = write_messages(tmp_path / 'bag', entries)
    summary = write_clouds(bag, tmp_path / 'out.ply', AssemblerConfig(), TOPICS)
    drops = Counter(summary.assembler.drops)
    assert drops.pop(JointInput.MALFORMED) == 1
    assert drops.pop('ranges must be of at least one beam') == 1
    assert drops.pop('stamp must be after 1970 and before 2038') == 1
    assert drops.total() == 1
    assert 'angle_increment must be' in next(iter(drops))
    assert summary.counts['clouds'] == len(scans) - 3
    assert '1 on /scan could not be decoded' in summary.notes


def test_the_order_of_messages_in_a_file_means_nothing(simulated, bag, tmp_path):
    entries = entries_of(simulated)
    np.random.default_rng(1).shuffle(entries)
    shuffled = write_messages(tmp_path / 'shuffled', entries)
    for source, name in ((bag, 'one.pcd'), (shuffled, 'two.pcd')):
        write_clouds(source, tmp_path / name, AssemblerConfig(), TOPICS)
    assert (tmp_path / 'one.pcd').read_bytes() == (tmp_path / 'two.pcd').read_bytes()


def test_messages_may_come_late_and_out_of_order(simulated, tmp_path):
    rng = np.random.default_rng(1)
    entries = [
        (time_ns + int(rng.integers(0, 50_000_000)), topic, message)
        for time_ns, topic, message in entries_of(simulated)
    ]
    late = write_messages(tmp_path / 'late', sorted(entries, key=lambda entry: entry[0]))
    summary = write_clouds(late, tmp_path / 'out.ply', AssemblerConfig(), TOPICS)
    # A joint state that comes after the one behind it is left out, which matters at reversals.
    drops = Counter(summary.assembler.drops)
    assert drops.pop(JointInput.OUT_OF_ORDER) > 0
    assert set(drops) <= {'joint samples missing at a reversal'}
    assert summary.counts['clouds'] == 40 - drops.total() >= 35
    points = PlyData.read(tmp_path / 'out.ply')['vertex'].data
    near = xyz_in(points)[np.linalg.norm(xyz_in(points), axis=1) < 3.0]
    distance = simulated.world.surface_distance(near, np.full(len(near), START_NS))
    assert np.sqrt(np.mean(distance**2)) < 0.005


def test_scans_stamped_at_their_end_and_without_time_between_beams(driving, tmp_path):
    entries = entries_of(driving)
    config = AssemblerConfig(
        ego_motion='beam', mixed_pixel_angle=0.0, time_in_compensated_clouds=True
    )
    bag = write_messages(tmp_path / 'bag', entries)
    write_clouds(bag, tmp_path / 'out.mcap', config, TOPICS)
    expected = clouds_in(tmp_path / 'out.mcap')
    for _, topic, message in entries:
        if topic == '/scan':
            late_ns = time_ns(message.header.stamp) + 70_000_000
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(late_ns, 10**9)
            message.time_increment = 0.0
    bag = write_messages(tmp_path / 'other', entries)
    corrected = replace(config, scan_delay=0.07, time_increment=0.1 / 1024)
    summary = write_clouds(bag, tmp_path / 'out.mcap', corrected, TOPICS)
    assert not summary.assembler.remarks
    found = clouds_in(tmp_path / 'out.mcap')
    assert len(found) == len(expected) == 40
    for (_, cloud, points), (_, other, others) in zip(found, expected, strict=True):
        assert time_ns(cloud.header.stamp) == time_ns(other.header.stamp)
        np.testing.assert_allclose(xyz_in(points), xyz_in(others), atol=1e-6)
        np.testing.assert_allclose(points['time'], others['time'], atol=1e-8)
    summary = write_clouds(bag, tmp_path / 'out.mcap', config, TOPICS)
    assert summary.assembler.remarks == {ONE_INSTANT: 40}


def test_a_scan_without_its_joint_states_is_dropped_at_the_deadline(simulated, tmp_path):
    entries = [
        entry
        for entry in entries_of(simulated)
        if entry[1] != '/joint_states' or not 1.0 < (entry[0] - START_NS) / 1e9 < 2.0
    ]
    bag = write_messages(tmp_path / 'bag', entries)
    summary = write_clouds(bag, tmp_path / 'out.ply', AssemblerConfig(), TOPICS)
    late = summary.assembler.drops['no joint state after it before the deadline']
    gap = summary.assembler.drops['joint samples more than 0.1 s apart']
    # The last scan before 2 s comes after 1.9 s: those that came before 1.6 s had waited for more
    # than the deadline then, those that came after 1.7 s have not by 2 s.
    assert 5 <= late <= 7
    assert late + gap == summary.assembler.drops.total() == 10


def test_without_odometry_scans_are_dropped_or_not_compensated(driving, tmp_path):
    entries = [
        entry
        for entry in entries_of(driving)
        if entry[1] != '/tf' or (entry[0] - START_NS) / 1e9 < 2.0
    ]
    bag = write_messages(tmp_path / 'bag', entries)
    config = AssemblerConfig(ego_motion='beam', mixed_pixel_angle=0.0)
    summary = write_clouds(bag, tmp_path / 'out.mcap', config, TOPICS)
    drops = summary.assembler.drops
    assert drops['no odometry after it before the deadline'] == drops.total() == 20
    config = replace(config, without_odometry='uncompensated')
    summary = write_clouds(bag, tmp_path / 'out.mcap', config, TOPICS)
    assert not summary.assembler.drops
    reason = 'uncompensated: no odometry after it before the deadline'
    assert summary.assembler.remarks == {reason: 20}
    frames = Counter(m.header.frame_id for _, m, _ in clouds_in(tmp_path / 'out.mcap'))
    assert frames == {'odom': 20, 'nodlidar_base_link': 20}
    with pytest.raises(OutputError, match=r'two frames, which only an \.mcap'):
        write_clouds(bag, tmp_path / 'out.ply', config, TOPICS)


def test_every_scan_at_the_end_of_a_bag_is_in_a_cloud_or_counted(driving, tmp_path):
    write_bag(driving, tmp_path / 'bag')
    # Both wait for what comes after the end: the estimator for joint samples, and odometry, which
    # is late, for longer than the deadline.
    config = AssemblerConfig(ego_motion='beam', estimator='trajectory', odometry_delay=0.3)
    summary = write_clouds(tmp_path / 'bag', tmp_path / 'a.ply', config, TOPICS)
    # Odometry ends 0.3 s before the last of ten scans per second.
    assert summary.assembler.drops['no odometry after it before the deadline'] == 3
    assert summary.counts['clouds'] == len(driving.ranges) - 3


def test_far_from_the_origin_of_odometry_clouds_have_their_own_frame(driving, tmp_path):
    entries = entries_of(driving)
    for _, topic, message in entries:
        if topic == '/tf':
            message.transforms[0].transform.translation.x += 1_000_000.0
    bag = write_messages(tmp_path / 'bag', entries)
    config = AssemblerConfig(ego_motion='beam')
    write_clouds(bag, tmp_path / 'out.mcap', config, TOPICS)
    frame = 'odom_999424_0_0'  # 61 times 16384 m
    assert {m.header.frame_id for _, m, _ in clouds_in(tmp_path / 'out.mcap')} == {frame}
    with AnyReader([tmp_path / 'out.mcap']) as reader:
        [static] = [c for c in reader.connections if c.topic == '/tf_static']
        [(_, _, raw)] = reader.messages([static])
        [transform] = reader.deserialize(raw, static.msgtype).transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ('odom', frame)
    assert transform.transform.translation.x == 999_424.0
    write_clouds(bag, tmp_path / 'out.ply', config, TOPICS)
    assert 'x y z count from 999424 0 0 m' in ' '.join(PlyData.read(tmp_path / 'out.ply').comments)


@pytest.mark.parametrize(
    ('topics', 'message'),
    [
        (Topics(scan='/front'), r'no topic /front; it has /joint_states \(sensor_msgs/msg/Joi'),
        (Topics(joint_states='/joints'), 'no topic /joints; it has .*, /scan '),
        (Topics(scan='/tf'), '/tf is of the type tf2_msgs/msg/TFMessage, not sensor_msgs/msg/L'),
        (Topics(tf='/other'), 'no topic /other'),
    ],
)
def test_a_topic_that_is_not_there_is_told_with_those_that_are(bag, tmp_path, topics, message):
    with pytest.raises(BagError, match=message):
        write_clouds(bag, tmp_path / 'out.ply', AssemblerConfig(ego_motion='beam'), topics)
    assert not list(tmp_path.glob('out*'))


def test_a_bag_without_scans_or_clouds_is_an_error_and_leaves_the_old_file(simulated, tmp_path):
    entries = entries_of(simulated)
    (tmp_path / 'out.ply').write_text('old')
    unreadable = [(0, '/scan', b'\x00\x01\x00\x00')]
    for kept, message in (
        ([*unreadable, *(e for e in entries if e[1] == '/joint_states')], 'has no scan'),
        ([e for e in entries if e[1] != '/joint_states'], 'no topic /joint_states'),
        (
            [e for e in entries if e[1] == '/scan' or e[0] < START_NS + 50_000_000],
            'no cloud from 40 scans: 40 no joint state after it before the deadline',
        ),
    ):
        bag = write_messages(tmp_path / f'bag{len(kept)}', sorted(kept, key=lambda e: e[0]))
        for suffix in ('ply', 'mcap'):
            with pytest.raises(BagError, match=message):
                write_clouds(bag, tmp_path / f'out.{suffix}', AssemblerConfig(), TOPICS)
    assert [file.name for file in tmp_path.glob('out*')] == ['out.ply']
    assert (tmp_path / 'out.ply').read_text() == 'old'


def test_what_a_bag_lacks_is_told_with_what_is_wrong_with_it(bag, tmp_path):
    [file] = bag.glob('*.mcap')
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(file.read_bytes()[:1000])
    with pytest.raises(BagError, match=r"no topic /scan; it has none; .*'cut.mcap' ends early"):
        write_clouds(cut, tmp_path / 'out.ply', AssemblerConfig(), Topics())


def test_a_joint_that_is_not_there_is_told_with_those_that_are(bag, tmp_path):
    missing = r"no joint state contains 'tilt', only 'nod_joint': set joint_name"
    message = rf'40 no joint state .* \({missing}\)'
    with pytest.raises(BagError, match=message):
        write_clouds(bag, tmp_path / 'out.ply', AssemblerConfig(joint_name='tilt'), TOPICS)


@pytest.mark.parametrize('suffix', ['ply', 'mcap'])
def test_when_it_is_interrupted_nothing_is_left(bag, tmp_path, suffix):
    def interrupt(now_ns, first_ns, last_ns):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_clouds(bag, tmp_path / f'out.{suffix}', AssemblerConfig(), TOPICS, interrupt)
    assert not list(tmp_path.glob('out*'))


def test_a_file_that_is_there_is_replaced_and_it_is_said(bag, tmp_path):
    (tmp_path / 'out.ply').write_text('old')
    summary = write_clouds(bag, tmp_path / 'out.ply', AssemblerConfig(), TOPICS)
    assert len(PlyData.read(tmp_path / 'out.ply')['vertex'].data)
    assert any('was replaced' in note for note in summary.notes)


def test_joint_states_whose_stamps_jitter_are_noted(simulated, bag, tmp_path):
    rng, entries = np.random.default_rng(2), entries_of(simulated)
    for _, topic, message in entries:
        if topic == '/joint_states':
            stamp_ns = time_ns(message.header.stamp) + round(rng.normal(0.0, 3e6))
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    jittering = write_messages(tmp_path / 'jittering', entries)
    for source, named in ((bag, False), (jittering, True)):
        summary = write_clouds(source, tmp_path / 'out.ply', AssemblerConfig(), TOPICS)
        assert any("'nod_joint' scatter by" in note for note in summary.notes) is named


def test_the_bag_itself_is_never_written(bag):
    [file] = bag.glob('*.mcap')
    before = file.read_bytes()
    for source, output in ((file, file), (bag, file), (bag, bag / 'new.mcap')):
        with pytest.raises(OutputError, match='is the input bag, or in it'):
            write_clouds(source, output, AssemblerConfig(), TOPICS)
    assert file.read_bytes() == before


@pytest.mark.parametrize('name', ['out', 'out.xyz', 'out.PLY'])
def test_a_kind_of_file_that_is_not_known_is_refused(bag, tmp_path, name):
    with pytest.raises(OutputError, match=r'must end in one of \.ply, \.pcd, \.mcap'):
        write_clouds(bag, tmp_path / name, AssemblerConfig(), TOPICS)


MEASURED = """
import sys
from nodlidar_assembler.commands.entry_points import assemble_bag
assert assemble_bag(sys.argv[1:]) == 0
[peak] = [line for line in open('/proc/self/status') if line.startswith('VmHWM')]
print(peak.split()[1])
"""


def peak_memory(*arguments):
    """Return the most memory that the command holds at a time [bytes]."""
    command = [sys.executable, '-c', MEASURED, *map(str, arguments)]
    output = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    return 1024 * int(output.splitlines()[-1])


@pytest.fixture(scope='module')
def long_bags(tmp_path_factory):
    """Return a function that gives two bags of a kind, the second three times as long.

    The first fills what is held for a time, such as the 20 s in which sweeps are compared.
    """
    folder = tmp_path_factory.mktemp('long')
    simulated = [recording(duration, 'wall', (0.01, 0.0)) for duration in (40.0, 120.0)]

    def bags(storage):
        paths = [folder / f'{storage.name}{k}' for k in range(2)]
        for path, each in zip(paths, simulated, strict=True):
            if not path.exists():
                write_bag(each, path, storage)
        return paths

    return bags


@pytest.mark.parametrize(
    ('storage', 'suffix', 'ego_motion'),
    [
        (StoragePlugin.MCAP, 'mcap', 'beam'),
        (StoragePlugin.SQLITE3, 'pcd', 'off'),
    ],
)
def test_memory_does_not_grow_with_the_bag(long_bags, tmp_path, storage, suffix, ego_motion):
    output = tmp_path / f'out.{suffix}'
    bags = long_bags(storage)
    short, long = (peak_memory(bag, output, '--ego-motion', ego_motion) for bag in bags)
    assert output.stat().st_size > 7.8e6
    assert long - short < 3e6


def bag_by_microcontroller(simulated, path):
    """Write a bag whose scans are stamped by a clock that began 3 s before the recording."""
    entries = entries_of(simulated)
    for _, topic, message in entries:
        if topic == '/scan':
            stamp = message.header.stamp
            stamp_ns = time_ns(stamp) - START_NS + 3_000_000_000
            stamp.sec, stamp.nanosec = divmod(stamp_ns, 10**9)
    return write_messages(path, entries)


def test_scans_by_a_clock_that_was_never_set_are_named(simulated, tmp_path):
    bag = bag_by_microcontroller(simulated, tmp_path / 'bag')
    with pytest.raises(BagError, match='scans are stamped 1699999997 s before joint states'):
        write_clouds(bag, tmp_path / 'out.mcap', AssemblerConfig(), TOPICS)


def test_scans_by_an_own_clock_make_the_same_clouds_later_by_their_way(simulated, bag, tmp_path):
    own = bag_by_microcontroller(simulated, tmp_path / 'own')
    write_clouds(bag, tmp_path / 'host.mcap', AssemblerConfig(), TOPICS)
    config = AssemblerConfig(scan_clock='device')
    write_clouds(own, tmp_path / 'device.mcap', config, TOPICS)
    host, device = clouds_in(tmp_path / 'host.mcap'), clouds_in(tmp_path / 'device.mcap')
    assert len(device) == len(host) > 30
    late = {
        time_ns(one.header.stamp) - time_ns(other.header.stamp)
        for (_, one, _), (_, other, _) in zip(device, host, strict=True)
    }
    scans = [(at_ns, m) for at_ns, topic, m in entries_of(simulated) if topic == '/scan']
    last_beam_ns = round(681 * scans[0][1].time_increment * 1e9)
    way_ns = min(at_ns - time_ns(m.header.stamp) - last_beam_ns for at_ns, m in scans)
    assert max(abs(each - way_ns) for each in late) <= 1000

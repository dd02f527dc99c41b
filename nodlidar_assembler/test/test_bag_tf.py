"""Odometry from the transforms of bags that are not laid out as our own."""

from dataclasses import replace

from bags import entries_of, recording, write_messages
from nodlidar_assembler.bags.bag_topics import BagError, Topics
from nodlidar_assembler.bags.read_bag import read_drive
from nodlidar_assembler.bags.sensor_log import clouds_in
from nodlidar_assembler.bags.write_clouds import write_clouds
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.bag_messages import TYPES
from nodlidar_common.time_order import TRANSFORM_OUT_OF_ORDER
from nodlidar_common.transforms import MALFORMED
import pytest

CONFIG = AssemblerConfig(ego_motion='beam')


@pytest.fixture(scope='module')
def driving():
    return recording(2.0, velocity=(0.4, 0.5))


def points_of(bag, tmp_path, config=CONFIG):
    write_clouds(bag, tmp_path / 'out.ply', config, Topics())
    return (tmp_path / 'out.ply').read_bytes()


def as_in_ros_1(entries):
    """Return the messages with fixed transforms on /tf, repeated with a later time."""
    [(_, _, mount)] = [entry for entry in entries if entry[1] == '/tf_static']
    odometry = [entry for entry in entries if entry[1] == '/tf']
    others = [entry for entry in entries if not entry[1].startswith('/tf')]
    again = [(time_ns, '/tf', mount) for time_ns, _, _ in odometry[::5]]
    return sorted([*others, *odometry, *again], key=lambda entry: entry[0])


def test_fixed_transforms_may_be_on_tf(driving, tmp_path):
    entries = entries_of(driving)
    expected = points_of(write_messages(tmp_path / 'bag', entries), tmp_path)
    other = write_messages(tmp_path / 'other', as_in_ros_1(entries))
    assert points_of(other, tmp_path) == expected


def test_messages_on_tf_that_cannot_be_told_are_counted_once(driving, tmp_path):
    entries = [*as_in_ros_1(entries_of(driving)), (2**62, '/tf', b'\x00\x01\x00\x00')]
    bag = write_messages(tmp_path / 'bag', entries)
    summary = write_clouds(bag, tmp_path / 'out.ply', CONFIG, Topics())
    assert '1 on /tf could not be decoded' in summary.notes


@pytest.mark.parametrize(
    ('config', 'message'),
    [
        (
            AssemblerConfig(ego_motion='beam', odom_frame='map'),
            r"\(TF: no transform from 'map' to 'base_link', but from 'odom' to 'base_link'\)",
        ),
        (
            AssemblerConfig(ego_motion='beam', frame_id='tower'),
            r"\(TF: no transform from 'odom' to 'tower', but from 'odom' to 'base_link'\)",
        ),
    ],
)
def test_the_frames_that_there_are_are_told(driving, tmp_path, config, message):
    bag = write_messages(tmp_path / 'bag', entries_of(driving))
    with pytest.raises(BagError, match=message):
        points_of(bag, tmp_path, config)


def test_transforms_that_move_in_a_row_are_told(driving, tmp_path):
    entries = as_in_ros_1(entries_of(driving))
    for k, (time_ns, topic, message) in enumerate(entries):
        [entry] = message.transforms if topic == '/tf' else [None]
        if entry is not None and entry.child_frame_id == 'nodlidar_base_link':
            old = entry.transform
            lifted = TYPES['geometry_msgs/msg/Vector3'](0.0, 0.0, 1e-3 * k)
            moved = TYPES['geometry_msgs/msg/Transform'](lifted, old.rotation)
            stamped = TYPES['geometry_msgs/msg/TransformStamped'](
                entry.header, entry.child_frame_id, moved
            )
            entries[k] = time_ns, topic, TYPES['tf2_msgs/msg/TFMessage']([stamped])
    bag = write_messages(tmp_path / 'bag', entries)
    message = "no transform from 'odom' to 'nodlidar_base_link', but from 'base_link' to 'nodli"
    with pytest.raises(BagError, match=message):
        points_of(bag, tmp_path)


@pytest.mark.parametrize('off', [-3600, 5])
def test_single_transforms_of_another_time_change_no_point_and_are_counted(driving, tmp_path, off):
    entries = entries_of(driving)
    expected = points_of(write_messages(tmp_path / 'bag', entries), tmp_path)
    odometry = [entry for entry in entries if entry[1] == '/tf']
    wrong = [
        (time_ns + 1, '/tf', later(message, off)) for time_ns, _, message in odometry[10:-10:10]
    ]
    bag = write_messages(tmp_path / 'off', sorted([*entries, *wrong], key=lambda entry: entry[0]))
    summary = write_clouds(bag, tmp_path / 'off.ply', CONFIG, Topics())
    assert (tmp_path / 'off.ply').read_bytes() == expected
    assert summary.assembler.drops == {TRANSFORM_OUT_OF_ORDER: len(wrong)}


def test_a_transform_that_is_no_pose_is_left_out_and_counted(driving, tmp_path):
    """As in the live node; one of them would make the whole bag unusable."""
    entries = entries_of(driving)
    expected = points_of(write_messages(tmp_path / 'bag', entries), tmp_path)
    time_ns, _, message = next(entry for entry in entries if entry[1] == '/tf')
    [entry] = message.transforms
    nothing = TYPES['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 0.0)
    wrong = replace(entry, transform=replace(entry.transform, rotation=nothing))
    bag = write_messages(
        tmp_path / 'other', [*entries, (time_ns + 1, '/tf', replace(message, transforms=[wrong]))]
    )
    summary = write_clouds(bag, tmp_path / 'other.ply', CONFIG, Topics())
    assert (tmp_path / 'other.ply').read_bytes() == expected
    assert summary.assembler.drops == {MALFORMED: 1}
    log, config = read_drive(bag, CONFIG, Topics()), replace(CONFIG, ego_motion='deskew')
    assert log.drops == {MALFORMED: 1}
    assert len(clouds_in(log, config)[0]) > 10


def later(message, seconds):
    """Return a TFMessage of one transform with a later stamp."""
    [entry] = message.transforms
    stamp = replace(entry.header.stamp, sec=entry.header.stamp.sec + seconds)
    return replace(message, transforms=[replace(entry, header=replace(entry.header, stamp=stamp))])

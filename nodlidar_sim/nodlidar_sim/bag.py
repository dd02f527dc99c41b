"""Writes a simulated recording as a bag, as the nodes would have recorded it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nodlidar_common.bag_messages import header, JOINT_STATE, SCAN, STORE, TF, transforms, TYPES
from nodlidar_common.pose import Pose
from nodlidar_sim.simulation import Recording
import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer

TOPICS = {'/scan': SCAN, '/joint_states': JOINT_STATE, '/tf': TF, '/tf_static': TF}
LATENESS_NS = 5_000_000  # from the end of a measurement to its message

# End of the measurement [ns], topic, message.
Entry = tuple[int, str, Any]


def write_bag(
    simulated: Recording, path: Path, storage: StoragePlugin = StoragePlugin.MCAP
) -> None:
    """Write scans, joint states, odometry (odom to base_link) and the mount as a bag.

    Parameters
    ----------
    simulated
        The recording.
    path
        Folder to create.
    storage
        Format of its file.
    """
    with Writer(path, version=9, storage_plugin=storage) as writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=STORE)
            for topic, kind in TOPICS.items()
        }
        for time_ns, topic, message in sorted(messages(simulated), key=lambda entry: entry[0]):
            raw = STORE.serialize_cdr(message, TOPICS[topic])
            writer.write(connections[topic], time_ns + LATENESS_NS, raw)


def messages(simulated: Recording) -> Iterator[Entry]:
    """Yield the messages, topic by topic, with the ends of their measurements."""
    mount = simulated.world.scene.mount
    start_ns = int(simulated.scan_stamp_ns[0])
    yield start_ns, '/tf_static', transforms(start_ns, 'base_link', 'nodlidar_base_link', mount)
    for stamp_ns, (x, y, yaw) in zip(
        simulated.odometry_stamp_ns.tolist(), simulated.odometry_pose.tolist(), strict=True
    ):
        pose = Pose.from_xyzrpy((x, y, 0.0, 0.0, 0.0, yaw))
        yield stamp_ns, '/tf', transforms(stamp_ns, 'odom', 'base_link', pose)
    for stamp_ns, pitch in zip(
        simulated.joint_stamp_ns.tolist(), simulated.joint_position.tolist(), strict=True
    ):
        yield stamp_ns, '/joint_states', _joint_state(stamp_ns, pitch)
    ranges = simulated.ranges.astype(np.float32)
    ends_ns = simulated.true_time_ns[:, -1].tolist()
    for stamp_ns, end_ns, row in zip(
        simulated.scan_stamp_ns.tolist(), ends_ns, ranges, strict=True
    ):
        yield end_ns, '/scan', _scan(simulated, stamp_ns, row)


def _scan(simulated: Recording, stamp_ns: int, ranges: Any) -> Any:
    sensor = simulated.sensor
    return TYPES[SCAN](
        header=header(stamp_ns, 'laser'),
        angle_min=float(simulated.azimuth[0]),
        angle_max=float(simulated.azimuth[-1]),
        angle_increment=sensor.angle_increment,
        time_increment=sensor.time_increment,
        scan_time=sensor.scan_time,
        range_min=sensor.range_min,
        range_max=sensor.range_max,
        ranges=ranges,
        intensities=np.zeros(0, dtype=np.float32),
    )


def _joint_state(stamp_ns: int, pitch: float) -> Any:
    nothing = np.zeros(0)
    return TYPES[JOINT_STATE](
        header(stamp_ns, ''), ['nod_joint'], np.array([pitch]), nothing, nothing
    )

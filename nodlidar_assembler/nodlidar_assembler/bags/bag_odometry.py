"""Reads odometry from the TF of a bag, without ROS."""

from collections import defaultdict
from dataclasses import dataclass, field
import math
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_types import BagError, STORE, TF
from nodlidar_assembler.clouds.ego_motion import LENGTH_TOLERANCE, Odometry, Poses
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import time_ns
import numpy as np
from rosbags.highlevel import AnyReader
from transforms3d.quaternions import quat2mat

# Parent, and pose in it, of each frame that does not move in its parent.
Fixed = dict[str, tuple[str, Pose]]


@dataclass(slots=True)
class _Transforms:
    """The transforms of a bag: fixed ones by child, moving ones by (parent, child), by time."""

    fixed: Fixed = field(default_factory=dict)
    moving: dict[tuple[str, str], dict[int, Any]] = field(
        default_factory=lambda: defaultdict(dict)
    )


def read_odometry(path: Path, odom_frame: str, frame: str) -> Odometry:
    """Return a frame's odometry: the transforms from odom_frame to what the frame is fixed to.

    Of equal stamps the last one counts.

    Raises
    ------
    BagError
        If there are none (several moving ones in a row are not added up), or a fixed one is none.
    OdometryError
        If they are no poses.
    """
    transforms = _read(path)
    carrier, mount = carried(frame, transforms.fixed)
    samples = sorted(transforms.moving[odom_frame, carrier].items())
    if not samples:
        raise BagError(f"'{path}' has no transforms from '{odom_frame}' to '{carrier}'")
    poses = Poses(
        np.array([_xyz(transform.translation) for _, transform in samples]),
        np.array([(*_xyz(t.rotation), t.rotation.w) for _, t in samples]),
    )
    return Odometry(np.array([stamp for stamp, _ in samples], np.int64), poses).mounted(mount)


def _read(path: Path) -> _Transforms:
    found = _Transforms()
    with AnyReader([path], default_typestore=STORE) as reader:
        wanted = [connection for connection in reader.connections if connection.msgtype == TF]
        for connection, _, raw in reader.messages(connections=wanted):
            message: Any = reader.deserialize(raw, TF)
            for entry in message.transforms:
                parent, child = entry.header.frame_id, entry.child_frame_id
                if connection.topic.endswith('tf_static'):
                    found.fixed[child] = parent, fixed_pose(entry.transform)
                else:
                    stamp_ns = time_ns(entry.header.stamp)
                    found.moving[parent, child][stamp_ns] = entry.transform
    return found


def carried(frame: str, fixed: Fixed) -> tuple[str, Pose]:
    """Return the frame that a frame is fixed to, over any number of fixed ones, and its pose."""
    mount, carrier, left = Pose.from_xyzrpy((0.0,) * 6), frame, dict(fixed)
    while carrier in left:
        parent, pose = left.pop(carrier)
        mount, carrier = pose @ mount, parent
    return carrier, mount


def fixed_pose(transform: Any) -> Pose:
    """Return a Transform message's pose; raises BagError if it is none."""
    q = transform.rotation
    length = math.hypot(q.w, *_xyz(q))
    if not abs(length - 1.0) <= LENGTH_TOLERANCE:
        raise BagError(f'a fixed transform has a quaternion of the length {length}')
    return Pose(np.array(_xyz(transform.translation)), quat2mat([q.w, *_xyz(q)]))


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z

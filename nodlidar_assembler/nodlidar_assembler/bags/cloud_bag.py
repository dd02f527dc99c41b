"""Writes clouds and level scans into an MCAP file, without ROS."""

from pathlib import Path
import shutil
from typing import Any

from nodlidar_assembler.clouds.level_scan import level_frame, LevelScan, message_fields
from nodlidar_assembler.clouds.origins import OF_ODOMETRY
from nodlidar_assembler.clouds.point_layout import fields, layout
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.bag_messages import header, SCAN, STORE, TF, transforms, TYPES
from nodlidar_common.pose import Pose
import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer

CLOUD = 'sensor_msgs/msg/PointCloud2'


class CloudBag:
    """An MCAP file with the topic /points; if any, /level_scan, and frames on /tf_static.

    Parameters
    ----------
    path
        File to write.
    config
        Of the assembler.
    """

    def __init__(self, path: Path, config: AssemblerConfig) -> None:
        self._path, self._config = path, config
        self._folder = path.with_name(path.name + '.bag')
        shutil.rmtree(self._folder, ignore_errors=True)
        self._writer = Writer(self._folder, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        self._clouds = self._connection('/points', CLOUD)
        self._frames: Connection | None = None
        self._level_scans: Connection | None = None
        self._known = {OF_ODOMETRY}

    def write(self, cloud: Points, frame_id: str, now_ns: int) -> None:
        """Add a cloud, as published at a time [ns]."""
        if cloud.origin not in self._known:
            self._known.add(cloud.origin)
            place = Pose(np.array(cloud.origin, dtype=np.float64), np.eye(3))
            stamp_ns, parent = int(cloud.time_ns[0]), self._config.odom_frame
            self._write_frame(transforms(stamp_ns, parent, frame_id, place), now_ns)
        raw = STORE.serialize_cdr(_message(cloud, frame_id), CLOUD)
        self._writer.write(self._clouds, now_ns, raw)

    def write_level_scan(self, scan: LevelScan, range_min: float, now_ns: int) -> None:
        """Add a level scan, as published at a time [ns]."""
        config = self._config
        frame_id = level_frame(config.frame_id, config)
        if self._level_scans is None:
            self._level_scans = self._connection('/level_scan', SCAN)
            if frame_id != config.frame_id:
                level = Pose(np.zeros(3), config.levelled.T)
                frame = transforms(scan.stamp_ns, config.frame_id, frame_id, level)
                self._write_frame(frame, now_ns)
        message = TYPES[SCAN](
            header=header(scan.stamp_ns, frame_id),
            ranges=scan.ranges,
            intensities=np.zeros(0, dtype=np.float32),
            **message_fields(scan, config, range_min),
        )
        self._writer.write(self._level_scans, now_ns, STORE.serialize_cdr(message, SCAN))

    def close(self) -> None:
        """Finish the file."""
        self._writer.close()
        [file] = self._folder.glob('*.mcap')
        file.replace(self._path)
        shutil.rmtree(self._folder)

    def abandon(self) -> None:
        """Remove what was written."""
        try:
            self._writer.abort()
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _connection(self, topic: str, msgtype: str) -> Connection:
        return self._writer.add_connection(topic, msgtype, typestore=STORE)

    def _write_frame(self, message: Any, now_ns: int) -> None:
        """Add a fixed frame."""
        if self._frames is None:
            self._frames = self._connection('/tf_static', TF)
        self._writer.write(self._frames, now_ns, STORE.serialize_cdr(message, TF))


def _message(cloud: Points, frame_id: str) -> Any:
    """Return an unorganised, dense cloud."""
    data = cloud.data
    return TYPES[CLOUD](
        header=header(cloud.stamp_ns, frame_id),
        fields=[TYPES['sensor_msgs/msg/PointField'](*field) for field in fields(data.dtype)],
        data=data.view(np.uint8),
        **layout(data),
    )

"""The service ~/assemble_scans: the points of an interval as one cloud."""

from collections.abc import Callable

from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.clouds.scan_memory import ScanMemory
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ros.cloud_message import cloud_message
from nodlidar_common.errors import ParameterError
from nodlidar_common.ros.qos import SERVICE
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.srv import AssembleScans
from rclpy.node import Node


class ScanService:
    """Answers requests for the points of an interval.

    Parameters
    ----------
    node, config
        The assembler, and its parameters at start.
    frame_id
        Returns the frame of points, given whether they are in odometry.

    Attributes
    ----------
    memory
        The points of the last scans.
    """

    def __init__(
        self, node: Node, config: AssemblerConfig, frame_id: Callable[[Points, bool], str]
    ) -> None:
        self.memory = ScanMemory(config.scan_memory, config.deskew_to)
        self._frame_id = frame_id
        self._frames = config.frame_id, config.odom_frame
        node.create_service(AssembleScans, '~/assemble_scans', self._assemble, qos_profile=SERVICE)

    def add(self, assembled: Assembled) -> None:
        """Keep the points of a scan."""
        self.memory.add(assembled.points, assembled.in_odometry, assembled.jumped)

    def _assemble(
        self, request: AssembleScans.Request, response: AssembleScans.Response
    ) -> AssembleScans.Response:
        """Answer with the points, or with the reason why they are not there."""
        try:
            points = self.memory.between(time_ns(request.begin), time_ns(request.end))
        except ParameterError as error:
            response.message = str(error)
            return response
        response.success = True
        if points is None:
            response.message = 'no points'
            response.cloud.header.stamp = request.end
            response.cloud.header.frame_id = self._frames[self.memory.in_odometry]
        else:
            response.message = f'{len(points.data)} points'
            frame_id = self._frame_id(points, self.memory.in_odometry)
            response.cloud = cloud_message(points, frame_id)
        return response

"""`ros2 run nodlidar_assembler calibrate BAG|live`: calibrates the sensor from a static scene.

Joint delay and zero, and the lidar's place in the nodding frame, by what must be flat.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodlidar_common.command_line import command

if TYPE_CHECKING:
    from nodlidar_assembler.bags.sensor_log import SensorLog
    from nodlidar_assembler.config import AssemblerConfig


def _record(
    config: AssemblerConfig | None, scan: str, joint_states: str, seconds: float
) -> tuple[SensorLog, AssemblerConfig]:
    # Only the running sensor needs ROS.
    from nodlidar_assembler.ros.live_log import record

    return record(config, scan, joint_states, seconds)


main = command(
    'calibrate', 'nodlidar_assembler.calibration.command:calibrate_and_report', __doc__, _record
)

"""`ros2 run nodlidar_assembler calibrate BAG|live`: calibrates the sensor from a static scene.

Joint delay and zero, and the lidar's place in the nodding frame, by what must be flat.
"""

from __future__ import annotations

from collections.abc import Sequence
import sys
from typing import TYPE_CHECKING

from nodlidar_common.command_line import run

if TYPE_CHECKING:
    from nodlidar_assembler.bags.sensor_log import SensorLog
    from nodlidar_assembler.config import AssemblerConfig


def main(argv: Sequence[str] | None = None) -> int:
    """Calibrate; return the exit status."""

    def work() -> None:
        # Imported here, so that `run` reports a missing package in one line.
        from nodlidar_assembler.calibration.command import calibrate_and_report

        calibrate_and_report(argv, __doc__, _record)

    return run('calibrate', work)


def _record(
    config: AssemblerConfig | None, scan: str, joint_states: str, seconds: float
) -> tuple[SensorLog, AssemblerConfig]:
    # Only the running sensor needs ROS.
    from nodlidar_assembler.ros.live_log import record

    return record(config, scan, joint_states, seconds)


if __name__ == '__main__':
    sys.exit(main())

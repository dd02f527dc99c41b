"""A node that publishes clouds.

`python -m bench.network.network_talker SIZE COUNT PERIOD PAUSE`.
"""

import sys
import time

from nodlidar_common.ros.node import run
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2

DISCOVERY = 20.0  # until a subscriber is there, at most [s]


class Talker(Node):
    """Publishes clouds of a size [bytes] with a period [s], once somebody listens, after a pause.

    In the pause [s] the subscriber finds this publisher, too.
    """

    def __init__(self, size: int, count: int, period: float, pause: float) -> None:
        super().__init__('talker')
        self.failed = False
        self._left = count
        self._message = PointCloud2(height=1, point_step=1, data=bytes(size))
        self._clouds = self.create_publisher(PointCloud2, 'points', 10)
        deadline = time.monotonic() + DISCOVERY
        while not self._clouds.get_subscription_count():
            if time.monotonic() > deadline:
                raise TimeoutError(f'nobody listens to clouds after {DISCOVERY:g} s')
            time.sleep(0.02)
        time.sleep(pause)
        self.create_timer(period, self._publish)

    def _publish(self) -> None:
        if self._left:
            self._left -= 1
            self._message.header.stamp.sec += 1
            self._clouds.publish(self._message)


if __name__ == '__main__':
    size, count, period, pause = map(float, sys.argv[1:])
    sys.exit(run(lambda: Talker(int(size), int(count), period, pause)))

"""The latency of clouds, from when the driver had the scan."""

from types import SimpleNamespace

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.ros.messages import time_message
from nodlidar_demo import delivery
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan, PointCloud2, TimeReference
from std_msgs.msg import Header

MS, START_NS = 1_000_000, 1_700_000_000_000_000_000


def recorded(topic, message, stamp_ms, published_ms):
    message.header.stamp = time_message(START_NS + stamp_ms * MS)
    return SimpleNamespace(topic=topic, message=message, time_ns=START_NS + published_ms * MS)


def scan(stamp_ms, published_ms):
    message = LaserScan(
        angle_min=-1.0, angle_max=1.0, angle_increment=1.0, time_increment=0.01,
        range_min=0.1, range_max=10.0, ranges=[1.0, 1.0, 1.0],
    )  # fmt: skip
    return recorded('/left/scan', message, stamp_ms, published_ms)


def cloud(stamp_ms, published_ms):
    return recorded('/left/points', PointCloud2(header=Header(), width=3), stamp_ms, published_ms)


@pytest.fixture
def latency(monkeypatch):
    """Return a function from what a bag holds to the latency [s]."""

    def of(messages, *others):
        monkeypatch.setattr(delivery, 'messages_of', lambda bag, wanted: messages)
        monkeypatch.setattr(delivery, 'read_nods', lambda bag: np.empty((0, 3)))
        return delivery.read_delivery('bag', *others).latency

    return of


def test_it_is_counted_from_the_last_byte(latency):
    arrival = TimeReference(time_ref=time_message(START_NS))
    messages = [recorded('/left/driver/arrival', arrival, 90, 91), scan(0, 93), cloud(10, 97)]
    assert latency(messages) == pytest.approx([0.007])


def test_it_is_counted_from_the_scan_of_another_driver(latency):
    """Its stamps are 50 ms late; a cloud begins with the first beam that has a range."""
    config = AssemblerConfig(scan_delay=0.05)
    refused = scan(120, 130)
    refused.message.time_increment = 0.02  # of another rate than before
    messages = [scan(50, 100), refused, cloud(10, 104), scan(150, 200), cloud(100, 209)]
    assert latency(messages, config) == pytest.approx([0.004, 0.009])
    assert latency(messages).size == 0

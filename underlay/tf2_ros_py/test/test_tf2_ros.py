from geometry_msgs.msg import TransformStamped
import pytest
import rclpy
from rclpy.time import Time
from tf2_ros import (
    Buffer,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformException,
    TransformListener,
)


def transform(parent, frame, seconds, x):
    message = TransformStamped(child_frame_id=frame)
    message.header.frame_id = parent
    message.header.stamp = Time(seconds=seconds).to_msg()
    message.transform.translation.x = x
    return message


def buffer_with(*transforms):
    buffer = Buffer()
    for each in transforms:
        buffer.set_transform(each, 'test')
    return buffer


def test_messages_in_and_out():
    given = transform('odom', 'base', 100, 2.0)
    buffer = buffer_with(given)
    for time in (Time(seconds=100), Time(seconds=100).to_msg(), Time()):
        assert buffer.lookup_transform('odom', 'base', time) == given
        assert buffer.can_transform('odom', 'base', time)
    assert buffer.get_latest_common_time('base', 'odom') == Time(seconds=100)
    back = buffer.lookup_transform('base', 'odom', Time())
    assert (back.header.frame_id, back.child_frame_id) == ('base', 'odom')
    assert back.transform.translation.x == -2.0


def test_what_cannot_be_looked_up():
    buffer = buffer_with(transform('odom', 'base', 100, 2.0))
    with pytest.raises(TransformException, match='map'):
        buffer.lookup_transform('map', 'base', Time())
    assert not buffer.can_transform('odom', 'base', Time(seconds=7))
    with pytest.raises(TransformException, match=r'only time 100\.000000 is in the buffer'):
        buffer.lookup_transform('odom', 'base', Time(seconds=7))
    buffer.set_transform(transform('world', 'moon', 1, 0.0), 'test')
    with pytest.raises(TransformException, match='unconnected'):
        buffer.get_latest_common_time('moon', 'base')


def test_invalid_transforms_are_ignored():
    buffer = buffer_with(transform('odom', 'odom', 5, 1.0), transform('odom', 'base', 5, 1.0))
    buffer.set_transform(transform('odom', 'base', 30, 1.0), 'test')
    buffer.set_transform(transform('odom', 'base', 6, 9.0), 'test')
    assert not buffer.can_transform('odom', 'base', Time(seconds=6))


def test_what_is_not_covered_is_named():
    with pytest.raises(NotImplementedError, match=r'Buffer\.transform '):
        Buffer().transform(None, 'base')
    with pytest.raises(NotImplementedError, match=r'Buffer\(cache_time=\)'):
        Buffer(cache_time=None)
    with pytest.raises(NotImplementedError, match=r'TransformListener\(spin_thread=\)'):
        TransformListener(Buffer(), None, spin_thread=True)


@pytest.fixture
def node():
    rclpy.init()
    node = rclpy.create_node('test_tf2_ros')
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def test_broadcasters_and_listener(node):
    static, moving = StaticTransformBroadcaster(node), TransformBroadcaster(node)
    static.sendTransform(transform('base', 'laser', 1, 1.0))
    static.sendTransform(transform('base', 'camera', 1, 2.0))
    static.sendTransform(transform('base', 'laser', 1, 9.0))
    buffer = Buffer()
    listener = TransformListener(buffer, node)  # hears what was sent before it was there
    while not buffer.can_transform('laser', 'camera', Time()):
        rclpy.spin_once(node, timeout_sec=1.0)
    between = buffer.lookup_transform('laser', 'camera', Time(seconds=7))
    assert between.transform.translation.x == 1.0
    assert between.header.stamp.sec == 7
    while not buffer.can_transform('odom', 'laser', Time(seconds=50)):
        moving.sendTransform(transform('odom', 'base', 50, 10.0))
        rclpy.spin_once(node, timeout_sec=0.05)
    assert buffer.lookup_transform('odom', 'laser', Time()).transform.translation.x == 11.0
    listener.unregister()

from message_filters import SimpleFilter, Subscriber
import pytest
import rclpy
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Header


def test_every_callback_gets_the_output():
    calls = []
    source = SimpleFilter()
    source.registerCallback(lambda *args: calls.append(args))
    source.registerCallback(lambda *args: calls.append(args[::-1]))
    source.signalMessage('x', 'y')
    assert calls == [('x', 'y'), ('y', 'x')]


@pytest.fixture
def node():
    rclpy.init()
    node = rclpy.create_node('test_message_filters')
    yield node
    node.destroy_node()
    rclpy.shutdown()


def test_subscriber_passes_on_what_it_receives(node):
    source = Subscriber(node, Header, 'stamps', qos_profile=qos_profile_sensor_data)
    publisher = node.create_publisher(Header, 'stamps', 10)
    assert source.sub.topic_name == '/stamps'
    received = []
    source.registerCallback(received.append)
    while not received:
        publisher.publish(Header(frame_id='x'))
        rclpy.spin_once(node, timeout_sec=0.05)
    assert received[0].frame_id == 'x'


def test_what_is_not_covered_is_named():
    import message_filters

    with pytest.raises(NotImplementedError, match=r'message_filters\.Cache'):
        _ = message_filters.Cache
    with pytest.raises(NotImplementedError, match=r'SimpleFilter\.getTopic'):
        SimpleFilter().getTopic()

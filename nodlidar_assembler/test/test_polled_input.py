"""An input whose messages wait until they are taken, on real DDS."""

from nodlidar_assembler.ros.input import PolledInput
from nodlidar_common.survival import Survival
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import JointState

SENT = 5


@pytest.fixture
def executor():
    rclpy.init()
    made = SingleThreadedExecutor()
    for name in ('listener', 'talker'):
        made.add_node(rclpy.create_node(name))
    yield made
    made.shutdown()
    for node in made.get_nodes():
        node.destroy_node()
    rclpy.shutdown()


def test_only_a_message_that_woke_the_node_is_announced(
    executor,
):
    listener, talker = executor.get_nodes()
    heard, wanted = [], []
    states = PolledInput(
        listener,
        JointState,
        'joint_states',
        SENT,
        Survival(print),
        lambda: bool(wanted),
        lambda: heard.append('woke'),
    )
    states.registerCallback(lambda state: heard.append(state.header.frame_id))
    sender = talker.create_publisher(JointState, 'joint_states', SENT)

    def send(name):
        message = JointState()
        message.header.frame_id = name
        sender.publish(message)

    def spin_until(is_over):
        for _ in range(500):
            executor.spin_once(timeout_sec=0.01)
            if is_over():
                return
        pytest.fail(f'only {heard} came')

    def take():
        states.take()
        return len(heard) == SENT

    spin_until(sender.get_subscription_count)
    for number in range(SENT):
        send(str(number))
    spin_until(take)
    assert heard == [str(number) for number in range(SENT)]
    wanted.append(True)
    send('last')
    spin_until(lambda: len(heard) == SENT + 2)
    assert heard[SENT:] == ['woke', 'last']

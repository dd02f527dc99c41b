"""A real lifecycle node, brought up and down by events."""

import logging
import sys

from launch.actions import (
    EmitEvent,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    Shutdown,
    TimerAction,
)
from launch.event_handlers import OnProcessStart
from launch.events import matches_action
from launch.events import Shutdown as ShutdownEvent
from launch.logging import get_logger
from launch_ros.actions import LifecycleNode
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events import matches_node_name
from launch_ros.events.lifecycle import ChangeState
from lifecycle_msgs.msg import Transition
import pytest

NODE = """
import sys
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

class Node(LifecycleNode):
    def on_configure(self, state):
        print('configure in', self.get_namespace(), flush=True)
        return getattr(TransitionCallbackReturn, sys.argv[1])

rclpy.init()
try:
    rclpy.spin(Node('code_name'))
except (KeyboardInterrupt, ExternalShutdownException):
    pass
"""


def lifecycle_node(on_configure):
    return LifecycleNode(
        executable=sys.executable,
        arguments=['-c', NODE, on_configure],
        name='device',
        namespace='robot',
        output='screen',
    )


def deadline():
    """End a launch that doesn't come to its end by itself."""
    return TimerAction(period=30.0, actions=[Shutdown(reason='too late')])


def change(transition_id, matcher):
    return EmitEvent(
        event=ChangeState(lifecycle_node_matcher=matcher, transition_id=transition_id)
    )


def test_transitions_follow_each_other(launch):
    node = lifecycle_node('SUCCESS')
    this = matches_action(node)
    named = matches_node_name('robot/device')
    code, out = launch(
        deadline(),
        node,
        RegisterEventHandler(
            OnProcessStart(
                target_action=node, on_start=[change(Transition.TRANSITION_CONFIGURE, this)]
            )
        ),
        RegisterEventHandler(
            OnStateTransition(
                target_lifecycle_node=node,
                start_state='configuring',
                goal_state='inactive',
                entities=[change(Transition.TRANSITION_ACTIVATE, named)],
            )
        ),
        RegisterEventHandler(
            OnStateTransition(
                target_lifecycle_node=node,
                goal_state='active',
                entities=[LogInfo(msg='it is active'), Shutdown()],
            )
        ),
    )
    assert code == 0
    assert 'configure in /robot' in out
    assert 'it is active' in out
    assert node.return_code == 0


def test_failed_transition_is_logged(launch, monkeypatch):
    def end_on_error(context):
        handler = logging.Handler(logging.ERROR)
        handler.emit = lambda record: context.emit_event_sync(ShutdownEvent(reason='an error'))
        logger = get_logger('launch_ros.actions.lifecycle_node')
        monkeypatch.setattr(logger, 'handlers', [handler])

    node = lifecycle_node('FAILURE')
    code, out = launch(
        deadline(),
        OpaqueFunction(function=end_on_error),
        node,
        change(Transition.TRANSITION_CONFIGURE, matches_action(node)),
    )
    assert code == 0
    assert "Failed to make transition 'TRANSITION_CONFIGURE' for LifecycleNode '/robot/dev" in out


def test_request_to_a_node_that_ended_is_abandoned(launch):
    node = LifecycleNode(executable='true', name='device', namespace='')
    code, out = launch(node, change(Transition.TRANSITION_CONFIGURE, matches_action(node)))
    assert code == 0
    assert "Abandoning wait for the '/device/change_state' service" in out


def test_transition_has_to_exist():
    with pytest.raises(ValueError, match='TRANSITION_ACTIVATE: 3'):
        change(99, lambda action: True)


def test_target_has_to_be_a_lifecycle_node():
    with pytest.raises(RuntimeError, match='LifecycleNode'):
        OnStateTransition(target_lifecycle_node=3, entities=[])

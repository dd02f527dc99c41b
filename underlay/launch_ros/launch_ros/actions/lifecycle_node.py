"""ROS lifecycle nodes as processes."""

from __future__ import annotations

import asyncio
from typing import Any

from launch import EventHandler, LaunchContext, SomeSubstitutionsType
from launch.actions import OpaqueFunction
from launch.logging import get_logger
from lifecycle_msgs.msg import TransitionEvent
from lifecycle_msgs.srv import ChangeState as ChangeStateService

from ..events.lifecycle import ChangeState, StateTransition, TRANSITIONS
from ..ros_adapter import get_ros_node
from .node import Node

# How often to look for the node's services; ROS tells nobody that they appeared.
_LOOK_S = 0.05


class LifecycleNode(Node):
    """Run a ROS lifecycle node: it follows ChangeState and emits StateTransition events."""

    def __init__(
        self, *, name: SomeSubstitutionsType, namespace: SomeSubstitutionsType, **kwargs: Any
    ) -> None:
        super().__init__(name=name, namespace=namespace, **kwargs)
        self._logger_ros = get_logger(__name__)

    def execute(self, context: LaunchContext) -> None:
        """Start the node, and listen to its transitions before it can make any."""
        super().execute(context)
        if self._task is None:
            return
        node = get_ros_node(context)
        self._subscription = node.create_subscription(
            TransitionEvent,
            f'{self.node_name}/transition_event',
            lambda msg: self._on_transition(context, msg),
            10,
        )
        self._client = node.create_client(ChangeStateService, f'{self.node_name}/change_state')
        context.register_event_handler(
            EventHandler(
                matcher=lambda event: (
                    isinstance(event, ChangeState) and event.lifecycle_node_matcher(self)
                ),
                entities=OpaqueFunction(function=self._on_change_state),
            )
        )

    def _on_transition(self, context: LaunchContext, msg: TransitionEvent) -> None:
        """Hand a message from the thread that spins to the event loop."""
        event = StateTransition(action=self, msg=msg)
        if context.asyncio_loop is not None:
            context.asyncio_loop.call_soon_threadsafe(context.emit_event_sync, event)

    def _on_change_state(self, context: LaunchContext) -> None:
        transition_id = context.locals.event.transition_id
        context.add_completion_future(
            context.asyncio_loop.create_task(self._change_state(context, transition_id))
        )

    async def _change_state(self, context: LaunchContext, transition_id: int) -> None:
        while not self._is_reachable():
            if context.is_shutdown or self._task.done():
                return self._abandon('')
            await asyncio.sleep(_LOOK_S)
        request = ChangeStateService.Request()
        request.transition.id = transition_id
        response = asyncio.get_running_loop().create_future()
        self._client.call_async(request).add_done_callback(
            lambda future: response.get_loop().call_soon_threadsafe(
                response.set_result, future.result()
            )
        )
        await asyncio.wait([response, self._task], return_when=asyncio.FIRST_COMPLETED)
        if not response.done():
            return self._abandon(' response')
        if not response.result().success:
            self._logger_ros.error(
                f"Failed to make transition '{TRANSITIONS[transition_id]}' "
                f"for LifecycleNode '{self.node_name}'"
            )
        return None

    def _is_reachable(self) -> bool:
        """Tell if a request would arrive, and the transition it makes be seen here."""
        return self._client.service_is_ready() and self._subscription.get_publisher_count() > 0

    def _abandon(self, what: str) -> None:
        service = self._client.service_name
        self._logger_ros.warning(
            f"Abandoning wait for the '{service}' service{what}, due to shutdown."
        )

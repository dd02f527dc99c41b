"""ROS lifecycle nodes as processes."""

from __future__ import annotations

import asyncio
from typing import Any

from launch import EventHandler, LaunchContext, SomeSubstitutionsType
from launch.actions import OpaqueFunction
from launch.logging import get_logger
from lifecycle_msgs.msg import TransitionEvent
from lifecycle_msgs.srv import ChangeState as ChangeStateService
from lifecycle_msgs.srv import GetState
from rclpy.client import Client

from ..events.lifecycle import ChangeState, StateTransition, TRANSITIONS
from ..ros_adapter import get_ros_node
from .node import Node

# How often to look for the node's services; ROS tells nobody that they appeared.
_LOOK_S = 0.05
# How long to wait for an answer before asking again.
_ANSWER_S = 1.0


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
        self._change_state_client = node.create_client(
            ChangeStateService, f'{self.node_name}/change_state'
        )
        self._get_state_client = node.create_client(GetState, f'{self.node_name}/get_state')
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
        if not await self._reachable(context):
            return self._abandon('')
        request = ChangeStateService.Request()
        request.transition.id = transition_id
        response = _call(self._change_state_client, request)
        await asyncio.wait([response, self._task], return_when=asyncio.FIRST_COMPLETED)
        if not response.done():
            return self._abandon(' response')
        if not response.result().success:
            self._logger_ros.error(
                f"Failed to make transition '{TRANSITIONS[transition_id]}' "
                f"for LifecycleNode '{self.node_name}'"
            )
        return None

    async def _reachable(self, context: LaunchContext) -> bool:
        """Wait until a request arrives and its transition is seen here; False if it never will.

        A shutdown destroys the clients, so it is looked for first.
        """
        while not (context.is_shutdown or self._task.done()):
            if self._is_discovered() and await self._answers() and not context.is_shutdown:
                return True
            await asyncio.sleep(_LOOK_S)
        return False

    def _is_discovered(self) -> bool:
        """Tell if the node's end of each connection is known here."""
        clients = (self._change_state_client, self._get_state_client)
        return self._subscription.get_publisher_count() > 0 and all(
            client.service_is_ready() for client in clients
        )

    async def _answers(self) -> bool:
        """Ask the node for its state, and tell if it answers.

        It can do so only once it knows the client made last, and so, since discovery keeps the
        order, the subscription to its transitions too: none will be missed.
        """
        response = _call(self._get_state_client, GetState.Request())
        done, _ = await asyncio.wait(
            [response, self._task], timeout=_ANSWER_S, return_when=asyncio.FIRST_COMPLETED
        )
        return response in done

    def _abandon(self, what: str) -> None:
        service = f'{self.node_name}/change_state'
        self._logger_ros.warning(
            f"Abandoning wait for the '{service}' service{what}, due to shutdown."
        )


def _call(client: Client, request: Any) -> asyncio.Future:
    """Call a service, and return the response to come."""
    loop = asyncio.get_running_loop()
    response = loop.create_future()
    client.call_async(request).add_done_callback(
        lambda future: loop.call_soon_threadsafe(response.set_result, future.result())
    )
    return response

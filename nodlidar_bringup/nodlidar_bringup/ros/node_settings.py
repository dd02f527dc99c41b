"""Asks running nodes for their parameters and states."""

from collections.abc import Callable, Iterable
import time
from typing import Any

from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import GetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

TIMEOUT = 1.5  # s, to find the services of all nodes, and again for their answers


def settings_of(node: Node, wanted: dict[str, tuple[str, ...]]) -> dict[str, dict[str, Any]]:
    """Return parameters of nodes, without those that do not answer.

    Parameters
    ----------
    node
        The node that asks.
    wanted
        Names of parameters by the full name of their node.
    """
    requests = {name: GetParameters.Request(names=list(keys)) for name, keys in wanted.items()}
    answers, _ = _answers(node, GetParameters, 'get_parameters', requests)
    return {name: _values(wanted[name], answer) for name, answer in answers.items()}


def mute(node: Node, names: Iterable[str]) -> tuple[str, ...]:
    """Return the nodes among some whose services were found, but do not answer."""
    requests = {name: GetParameters.Request() for name in names}
    return _answers(node, GetParameters, 'get_parameters', requests)[1]


def inactive(node: Node, names: Iterable[str]) -> dict[str, bool]:
    """Return which of some lifecycle nodes are not active, and whether these are finalized."""
    requests = {name: GetState.Request() for name in names}
    answers, _ = _answers(node, GetState, 'get_state', requests)
    states = {name: answer.current_state.id for name, answer in answers.items()}
    return {
        name: state == State.PRIMARY_STATE_FINALIZED
        for name, state in states.items()
        if state != State.PRIMARY_STATE_ACTIVE
    }


def _answers(
    node: Node, kind: Any, service: str, requests: dict[str, Any]
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the answers to requests by the full name of their nodes, and who gave none."""
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    clients = {name: node.create_client(kind, f'{name}/{service}') for name in requests}
    try:
        _spin(executor, lambda: all(client.service_is_ready() for client in clients.values()))
        futures = {
            name: client.call_async(requests[name])
            for name, client in clients.items()
            if client.service_is_ready()
        }
        _spin(executor, lambda: all(future.done() for future in futures.values()))
        answers = {name: future.result() for name, future in futures.items() if future.done()}
        return answers, tuple(name for name in futures if name not in answers)
    finally:
        executor.remove_node(node)
        for client in clients.values():
            node.destroy_client(client)


def _spin(executor: SingleThreadedExecutor, finished: Callable[[], bool]) -> None:
    deadline = time.monotonic() + TIMEOUT
    while not finished() and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.05)


def _values(names: tuple[str, ...], answer: Any) -> dict[str, Any]:
    values = map(parameter_value_to_python, answer.values)
    return {n: v for n, v in zip(names, values, strict=False) if v is not None}

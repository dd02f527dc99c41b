"""Reads parameters of running nodes."""

import time
from typing import Any

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

_VALUES = {
    ParameterType.PARAMETER_BOOL: 'bool_value',
    ParameterType.PARAMETER_INTEGER: 'integer_value',
    ParameterType.PARAMETER_DOUBLE: 'double_value',
    ParameterType.PARAMETER_STRING: 'string_value',
    ParameterType.PARAMETER_DOUBLE_ARRAY: 'double_array_value',
}


def settings_of(
    node: Node, wanted: dict[str, tuple[str, ...]], timeout: float = 1.0
) -> dict[str, dict[str, Any]]:
    """Return parameters of nodes, without those that do not answer.

    Parameters
    ----------
    node
        The node that asks.
    wanted
        Names of parameters by the full name of their node.
    timeout
        For all answers together [s].
    """
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    deadline = time.monotonic() + timeout
    clients = {
        name: node.create_client(GetParameters, f'{name}/get_parameters') for name in wanted
    }
    try:
        while time.monotonic() < deadline and not all(
            client.service_is_ready() for client in clients.values()
        ):
            executor.spin_once(timeout_sec=0.05)
        futures = {
            name: client.call_async(GetParameters.Request(names=list(wanted[name])))
            for name, client in clients.items()
            if client.service_is_ready()
        }
        while time.monotonic() < deadline and not all(f.done() for f in futures.values()):
            executor.spin_once(timeout_sec=0.05)
        return {
            name: _values(wanted[name], future.result())
            for name, future in futures.items()
            if future.done()
        }
    finally:
        executor.remove_node(node)
        for client in clients.values():
            node.destroy_client(client)


def _values(names: tuple[str, ...], answer: Any) -> dict[str, Any]:
    return {
        name: getattr(value, _VALUES[value.type])
        for name, value in zip(names, answer.values, strict=False)
        if value.type in _VALUES
    }

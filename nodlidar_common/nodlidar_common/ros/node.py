"""The process of a node: start, spinning and end."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import gc
import signal
import sys

from nodlidar_common.errors import NodlidarError
from nodlidar_common.ros.device_node import DeviceNode
from nodlidar_common.ros.executor import Executor
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.survival import Survival
import rclpy
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

CHECK_PERIOD = 0.2  # s, between two checks whether to end
ANSWERING = 0.3  # s, for which a node goes on when another one takes over
ANSWERING_AT_END = 8.0  # s; ros2 launch kills a node 10 s after a Ctrl-C
# What rclpy raises for names, parameters and QoS that a user gave.
_OF_ARGUMENTS = NameValidationException, ParameterException, RuntimeError


def run(make_node: Callable[[], Node], args: list[str] | None = None) -> int:
    """Run a node until a signal or a failure ends it; return the exit status.

    An exception in a callback does not end the node: it is logged with its traceback and counted,
    by the node's own `survival` if it has one. A node with a `successor` that is not None goes on
    for ANSWERING, to answer what was asked meanwhile, and is destroyed; the node that its
    successor makes takes over. After a signal, a node that is `answering` a request goes on until
    it has, for ANSWERING_AT_END at most.
    """
    with _ending_signals() as received:
        try:
            _init(args)
            node = make_node()
        except (NodlidarError, *_OF_ARGUMENTS) as error:
            print(f'{sys.argv[0]}: {error}', file=sys.stderr)
            rclpy.try_shutdown()
            return 2
        try:
            if isinstance(node, DeviceNode) and not received:
                node.autostart()
            _spin(node, received)
            while not received and (successor := _successor(node)) is not None:
                node.destroy_node()
                node = successor()
                _spin(node, received)
        finally:
            node.destroy_node()
            rclpy.shutdown()
    return 1 if getattr(node, 'failed', False) else 0


def _successor(node: Node) -> Callable[[], Node] | None:
    return getattr(node, 'successor', None)


def _init(args: list[str] | None) -> None:
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # rcl cannot read the arguments or a parameter file
        raise NodlidarError(str(error)) from error


@contextmanager
def _ending_signals() -> Iterator[list[int]]:
    """Collect the signals that end the program.

    rclpy's own handlers invalidate its context at once: then a publication in progress fails, and
    an executor that is about to wait raises an error, or misses the signal and keeps waiting.
    """
    received: list[int] = []
    ending = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # nohup ignores it
        ending.append(signal.SIGHUP)  # the terminal was closed
    before = {
        number: signal.signal(number, lambda got, _: received.append(got)) for number in ending
    }
    try:
        yield received
    finally:
        for number, handler in before.items():
            # A second Ctrl-C would interrupt the shutdown that the first one started.
            signal.signal(number, signal.SIG_IGN if received else handler)


def _spin(node: Node, received: list[int]) -> None:
    """Run a node until a signal was received, it has failed, or another one takes over."""
    # rclpy's spin_until_future_complete leaks some memory with every callback.
    executor = Executor()
    executor.add_node(node)
    # What lives as long as the node need not be looked at in every collection.
    gc.unfreeze()
    gc.collect()
    gc.freeze()
    survival = getattr(node, 'survival', None) or Survival(node.get_logger().error)
    ends_ns: int | None = None
    try:
        while rclpy.ok() and not (received and not getattr(node, 'answering', False)):
            if ends_ns is None and (received or _successor(node) is not None):
                longest = ANSWERING_AT_END if received else ANSWERING
                ends_ns = steady_ns() + round(longest * NS_PER_S)
            if getattr(node, 'failed', False) or (ends_ns is not None and steady_ns() > ends_ns):
                return
            with survival.surviving():
                executor.spin_once(timeout_sec=CHECK_PERIOD)
    finally:
        executor.shutdown()

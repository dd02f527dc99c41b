"""What the page controls, by the services of the nodes."""

from collections.abc import Callable
from functools import partial
from queue import SimpleQueue
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nodlidar_common.survival import Survival
from nodlidar_viewer.controls import Values
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

ASSEMBLER, DEVICES = 'assembler', ('servo', 'driver')
Answer = Callable[[str], object]


class RosCommands:
    """Asks the nodes in the namespace of this one.

    Its methods may be called from any thread; answers come from that of the executor.
    """

    def __init__(self, node: Node, survival: Survival) -> None:
        self._parameters = AsyncParameterClient(node, ASSEMBLER)
        self._states = {
            device: node.create_client(ChangeState, f'{device}/change_state') for device in DEVICES
        }
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._asked = node.create_guard_condition(survival.guarded(self._work))
        self._survival = survival

    def read(self, names: list[str], then: Callable[[Values], object], fail: Answer) -> None:
        """Pass on parameters of the assembler."""

        def received(response: Any) -> None:
            values = [parameter_value_to_python(value) for value in response.values]
            if len(values) == len(names):
                then(dict(zip(names, values, strict=True)))
            else:
                fail('the assembler has other parameters')

        self._ask_assembler(lambda: self._parameters.get_parameters(names), received, fail)

    def change(self, values: Values, answer: Answer) -> None:
        """Set parameters of the assembler, all or none."""
        chosen = [Parameter(name, value=value) for name, value in values.items()]

        def received(response: Any) -> None:
            result = response.result
            answer('applied' if result.successful else f'refused: {result.reason}')

        self._ask_assembler(
            lambda: self._parameters.set_parameters_atomically(chosen), received, answer
        )

    def switch(self, on: bool, answer: Answer) -> None:
        """Start or stop the devices."""
        wanted = Transition.TRANSITION_ACTIVATE if on else Transition.TRANSITION_DEACTIVATE
        request = ChangeState.Request(transition=Transition(id=wanted))

        words: dict[str, str] = {}

        def tell(device: str, text: str) -> None:
            words[device] = f'{device}: {text}'
            answer('; '.join(sorted(words.values())))

        def ask() -> None:
            for device, client in self._states.items():
                if client.service_is_ready():
                    asked = client.call_async(request)
                    asked.add_done_callback(self._survival.guarded(partial(told, device)))
                else:
                    tell(device, 'does not answer')

        def told(device: str, future: Any) -> None:
            done = 'started' if on else 'stopped'
            tell(device, done if future.result().success else f'cannot be {done} now')

        self._put(ask)

    def _ask_assembler(
        self, ask: Callable[[], Any], received: Callable[[Any], None], fail: Answer
    ) -> None:
        def work() -> None:
            if self._parameters.services_are_ready():
                callback = self._survival.guarded(lambda future: received(future.result()))
                ask().add_done_callback(callback)
            else:
                fail('the assembler does not answer')

        self._put(work)

    def _put(self, job: Callable[[], None]) -> None:
        self._jobs.put(job)
        self._asked.trigger()

    def _work(self) -> None:
        while not self._jobs.empty():
            self._jobs.get()()

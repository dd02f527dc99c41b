"""What the page controls, by the services of the nodes."""

from collections.abc import Callable
from functools import partial
from queue import SimpleQueue
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nodlidar_common.ros.steady import create_steady_timer
from nodlidar_common.survival import Survival
from nodlidar_viewer.controls import APPLIED, Values
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

ASSEMBLER, DEVICES = 'assembler', ('servo', 'driver')
Answer = Callable[[str], object]
# s; the service of a node that was killed looks ready for some 20 s more.
PATIENCE = 3.0


class RosCommands:
    """Asks the nodes in the namespace of this one.

    Its methods may be called from any thread; answers come from that of the executor.
    """

    def __init__(self, node: Node, survival: Survival) -> None:
        self._node = node
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
            answer(APPLIED if result.successful else f'refused: {result.reason}')

        self._ask_assembler(
            lambda: self._parameters.set_parameters_atomically(chosen), received, answer
        )

    def switch(self, on: bool, answer: Answer) -> None:
        """Start or stop the devices."""
        wanted = Transition.TRANSITION_ACTIVATE if on else Transition.TRANSITION_DEACTIVATE
        request = ChangeState.Request(transition=Transition(id=wanted))

        words: dict[str, str] = {}

        def report(device: str, text: str) -> None:
            words[device] = f'{device}: {text}'
            answer('; '.join(sorted(words.values())))

        def ask() -> None:
            for device, client in self._states.items():
                silent = partial(report, device, 'does not answer')
                if client.service_is_ready():
                    self._await(client.call_async(request), partial(changed, device), silent)
                else:
                    silent()

        def changed(device: str, response: Any) -> None:
            done = 'started' if on else 'stopped'
            report(device, done if response.success else f'cannot be {done} now')

        self._put(ask)

    def _ask_assembler(
        self, ask: Callable[[], Any], received: Callable[[Any], None], fail: Answer
    ) -> None:
        silent = partial(fail, 'the assembler does not answer')

        def work() -> None:
            if self._parameters.services_are_ready():
                self._await(ask(), received, silent)
            else:
                silent()

        self._put(work)

    def _await(
        self, asked: Any, received: Callable[[Any], object], silent: Callable[[], object]
    ) -> None:
        """Pass on the response to a request, or that there is none."""

        def expire() -> None:
            self._node.destroy_timer(timer)
            if not asked.done():
                asked.cancel()
                silent()

        def done(future: Any) -> None:
            if not future.cancelled():
                received(future.result())

        timer = create_steady_timer(self._node, PATIENCE, self._survival.guarded(expire))
        asked.add_done_callback(self._survival.guarded(done))

    def _put(self, job: Callable[[], None]) -> None:
        self._jobs.put(job)
        self._asked.trigger()

    def _work(self) -> None:
        while not self._jobs.empty():
            self._jobs.get()()

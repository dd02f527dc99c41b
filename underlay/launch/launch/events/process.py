"""Events of processes, and matchers for those that are aimed at processes."""

from __future__ import annotations

from collections.abc import Callable
import signal as signals
from typing import TYPE_CHECKING

from underlay_refusal import refuse

from ..event import Event

if TYPE_CHECKING:
    from ..actions import ExecuteProcess

    Matcher = Callable[[ExecuteProcess], bool]

__all__ = [
    'ProcessExited',
    'ProcessStarted',
    'ProcessTargetedEvent',
    'RunningProcessEvent',
    'ShutdownProcess',
    'SignalProcess',
    'matches_executable',
    'matches_name',
    'matches_pid',
]
__getattr__ = refuse(__name__, __all__)


class RunningProcessEvent(Event):
    """Something happened to a process.

    Parameters
    ----------
    action
        The action that started it.
    name, cmd, cwd, env, pid
        The process's unique name, command line, directory (None: this process's own),
        environment and number.

    """

    name = 'launch.events.process.RunningProcessEvent'

    def __init__(
        self,
        *,
        action: ExecuteProcess,
        name: str,
        cmd: list[str],
        cwd: str | None,
        env: dict[str, str] | None,
        pid: int,
    ) -> None:
        self.action = action
        self.process_name = name
        self.cmd = cmd
        self.cwd = cwd
        self.env = env
        self.pid = pid


class ProcessStarted(RunningProcessEvent):
    """A process started."""

    name = 'launch.events.process.ProcessStarted'


class ProcessExited(RunningProcessEvent):
    """A process ended; a negative returncode is the signal that ended it."""

    name = 'launch.events.process.ProcessExited'

    def __init__(self, *, returncode: int, **details) -> None:
        super().__init__(**details)
        self.returncode = returncode


class ProcessTargetedEvent(Event):
    """Something is to be done to the processes that match."""

    name = 'launch.events.process.ProcessTargetedEvent'

    def __init__(self, *, process_matcher: Matcher) -> None:
        self.process_matcher = process_matcher


class ShutdownProcess(ProcessTargetedEvent):
    """Processes are to end: SIGINT, then SIGTERM, then SIGKILL."""

    name = 'launch.events.process.ShutdownProcess'


class SignalProcess(ProcessTargetedEvent):
    """Processes are to get a signal, given as such or as the text 'SIGKILL'."""

    name = 'launch.events.process.SignalProcess'

    def __init__(self, *, signal_number: str | signals.Signals, process_matcher: Matcher) -> None:
        super().__init__(process_matcher=process_matcher)
        if not isinstance(signal_number, (str, signals.Signals)):
            raise TypeError(f"expected a 'str' or a 'signal.Signals', got {signal_number!r}")
        self.signal = signal_number

    @property
    def signal_name(self) -> str:
        """The signal's name, as SIGINT."""
        return self.signal if isinstance(self.signal, str) else self.signal.name


def _matches(test: Callable[[dict], bool]) -> Matcher:
    return lambda action: action.process_details is not None and test(action.process_details)


def matches_pid(pid: int) -> Matcher:
    """Return a matcher of the process of this number."""
    return _matches(lambda details: details.get('pid') == pid)


def matches_name(name: str) -> Matcher:
    """Return a matcher of the process of this unique name, as sleep-1."""
    return _matches(lambda details: details['name'] == name)


def matches_executable(executable: str) -> Matcher:
    """Return a matcher of processes whose command's first word ends so."""
    return _matches(lambda details: details['cmd'][0].endswith(executable))

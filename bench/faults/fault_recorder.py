"""A recorder in its own process, so that the devices of this one are never late."""

from __future__ import annotations

from collections.abc import Callable
import multiprocessing
from multiprocessing.sharedctypes import Synchronized
from multiprocessing.synchronize import Event
from pathlib import Path
import signal
import time

from nodlidar_demo.ros.recorder import Recorder
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

SCAN_RATE = 10.0
HEALTHY_SHARE = 0.9
_PERIOD = 0.02  # of checks [s]
_processes = multiprocessing.get_context('spawn')


class RecorderProcess:
    """Records a sensor into a bag until it is closed, and watches the rate of the clouds."""

    def __init__(self, bag: Path) -> None:
        self._count: Synchronized[int] = _processes.Value('q', 0)
        self._ended = _processes.Event()
        arguments = (bag, self._count, self._ended)
        self._process = _processes.Process(target=_record, args=arguments)
        self._process.start()
        self._counted = 0
        self._clouds: list[float] = []

    def close(self) -> None:
        """Finish the bag."""
        self._ended.set()
        self._process.join()

    def spin(self, duration: float) -> None:
        """Wait for a time [s]."""
        self.spin_until(lambda: False, duration)

    def spin_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition holds or a time [s] is over; return whether it holds."""
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() >= deadline:
                return False
            time.sleep(_PERIOD)
            self._update()
        return True

    def healthy(self) -> bool:
        """Return whether clouds came at their rate in the last second."""
        return len(self._clouds) >= HEALTHY_SHARE * SCAN_RATE

    def _update(self) -> None:
        now, count = time.monotonic(), self._count.value
        self._clouds = [t for t in self._clouds if now - t < 1.0]
        self._clouds += [now] * (count - self._counted)
        self._counted = count


def _record(bag: Path, count: Synchronized[int], ended: Event) -> None:
    """Record until the end; count clouds."""
    # A Ctrl-C reaches this process too, but the bag must be finished.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    recorder, executor = Recorder(bag), SingleThreadedExecutor()
    executor.add_node(recorder)
    while not ended.is_set():
        executor.spin_once(timeout_sec=_PERIOD)
        count.value = recorder.counts['points']
    recorder.close()
    recorder.destroy_node()
    rclpy.shutdown()

"""An emulated lidar together with its driver, for third-party drivers: its output is scans."""

from collections import deque
from dataclasses import replace

from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.devices.device import SilentDevice
from nodlidar_sim.devices.other_lidars import OtherLidar, Published, Revolution
from nodlidar_sim.world.effects import Measure
import numpy as np

_LATEST = 4e-3  # time that USB and driver take at most for a revolution [s]
_MOST_WAITING = 10  # scans that nobody takes


class DrivenLidar(SilentDevice):
    """A lidar whose driver runs in it; a `Device` without bytes.

    Parameters
    ----------
    lidar
        The lidar and its driver.
    measure
        As that of UrgEmulator. Called once a revolution, when the driver has it.
    start_ns
        Host time of power-up [ns].
    clock_rate
        Seconds of its clock, which paces its beams, in a second of the host.
    seed
        Of the phase of the rotation, the number of beams and the delays of USB.

    Attributes
    ----------
    scans
        What the driver has published; whoever takes them removes them. Safe between threads.
    """

    def __init__(
        self,
        lidar: OtherLidar,
        measure: Measure,
        *,
        start_ns: int,
        clock_rate: float = 1.0,
        seed: int = 0,
    ) -> None:
        self.lidar = lidar
        self.scans: deque[Published] = deque(maxlen=_MOST_WAITING)
        self._measure, self._clock_rate = measure, clock_rate
        self._rng = np.random.default_rng(seed)
        self._poll_ns = start_ns + self._within(lidar.poll_period)
        begin_ns = start_ns + self._within(lidar.beams[0] * lidar.beam_period)
        self._pending = self._revolution(begin_ns, 0, begin_ns)

    def transmit(self, now_ns: int) -> bytes:
        """Publish the revolutions that the driver has by a time [ns]; return nothing."""
        while self._pending.fetched_ns <= now_ns:
            done = self._pending
            steps = len(done.times_ns) + self.lidar.dark_steps
            period_ns = round(steps * self.lidar.beam_period / self._clock_rate * NS_PER_S)
            begin_ns = int(done.times_ns[0]) + period_ns
            self._pending = self._revolution(begin_ns, period_ns, done.fetched_ns)
            if self._pending.fetched_ns == done.fetched_ns:  # of two, the driver sees the later
                waited_since_ns = done.waited_since_ns
                self._pending = replace(self._pending, waited_since_ns=waited_since_ns)
                continue
            ranges = self._measure(done.times_ns, done.azimuths)
            self.scans.append(self.lidar.published(done, ranges))
        return b''

    def next_event_ns(self) -> int:
        """Return when the driver next publishes [ns]."""
        return self._pending.fetched_ns

    def _revolution(self, begin_ns: int, period_ns: int, waited_since_ns: int) -> Revolution:
        """Return a revolution that begins at a time [ns]."""
        fewest, most = self.lidar.beams
        beams = int(self._rng.integers(fewest, most + 1))
        times_ns, azimuths = self.lidar.rays(begin_ns, beams, self._clock_rate)
        ready_ns = int(times_ns[-1]) + self._within(_LATEST)
        period, fetched_ns = period_ns / NS_PER_S, self._poll_from(ready_ns)
        return Revolution(times_ns, azimuths, period, waited_since_ns, fetched_ns)

    def _poll_from(self, ready_ns: int) -> int:
        """Return when the driver finds what is ready at a time [ns]."""
        if not self.lidar.poll_period:
            return ready_ns
        period_ns = round(self.lidar.poll_period * NS_PER_S)
        return ready_ns + (self._poll_ns - ready_ns) % period_ns

    def _within(self, duration: float) -> int:
        """Return a random part of a duration [s] in ns."""
        return round(self._rng.uniform(0.0, duration) * NS_PER_S)

"""Devices with bad wiring, for tests of their hosts."""

from nodlidar_sim.devices.device import Device
from nodlidar_sim.devices.faulty_line import FaultyLine


class FaultyDevice(FaultyLine):
    """A device behind a bad connection; the inherited line is the one from device to host.

    Parameters
    ----------
    device
        The emulated device.
    seed
        Of the choice of bytes.

    Attributes
    ----------
    to_device
        The line from host to device.
    stalled_until_ns
        Until this time no byte passes in either direction; then the device receives all [ns].
    """

    def __init__(self, device: Device, seed: int = 0) -> None:
        super().__init__(seed)
        self.to_device = FaultyLine([seed, 1])
        self.stalled_until_ns = 0
        self._held = b''
        self._device = device

    def receive(self, data: bytes, now_ns: int) -> None:
        """Pass bytes of the host to the device, with the line's faults."""
        self._held += data
        self._pass_on(now_ns)

    def transmit(self, now_ns: int) -> bytes:
        """Return bytes of the device, with the line's faults."""
        if now_ns < self.stalled_until_ns:
            return b''
        self._pass_on(now_ns)
        return self.carry(self._device.transmit(now_ns), now_ns)

    def next_event_ns(self) -> int | None:
        """Return when bytes are next due, or the device's next event [ns]."""
        if self._held:
            return self.stalled_until_ns
        events = (
            self._device.next_event_ns(),
            super().next_event_ns(),
            self.to_device.next_event_ns(),
        )
        return min((event for event in events if event is not None), default=None)

    def _pass_on(self, now_ns: int) -> None:
        if now_ns < self.stalled_until_ns:
            return
        held, self._held = self._held, b''
        received = self.to_device.carry(held, now_ns)
        if received:
            self._device.receive(received, now_ns)


class EchoingDevice:
    """A device behind an adapter that also sends back what the host sends, as on one wire.

    Parameters
    ----------
    device
        The emulated device.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._echo, self._came_ns = b'', 0

    def receive(self, data: bytes, now_ns: int) -> None:
        """Pass bytes of the host to the device, and back."""
        self._echo += data
        self._came_ns = now_ns
        self._device.receive(data, now_ns)

    def transmit(self, now_ns: int) -> bytes:
        """Return the bytes that are due, the echo first."""
        echo, self._echo = self._echo, b''
        return echo + self._device.transmit(now_ns)

    def next_event_ns(self) -> int | None:
        """Return when bytes are next due, or the device's next event [ns]."""
        return self._came_ns if self._echo else self._device.next_event_ns()

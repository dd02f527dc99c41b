"""A device with bad wiring, for tests of what hosts make of it."""

from nodlidar_sim.device import Device
import numpy as np


class FaultyDevice:
    """A device whose bytes to the host are damaged, lost, cut off or late.

    Parameters
    ----------
    device
        The sound device.
    seed
        Of the choice of bytes.

    Attributes
    ----------
    corrupt_rate
        Share of the bytes that have one bit flipped.
    drop_rate
        Share of the bytes that are lost.
    mute
        Nothing at all reaches the host.
    stalled_until_ns
        Before this time nothing passes, in either direction; the device hears it all then.
    """

    def __init__(self, device: Device, seed: int = 0) -> None:
        self.corrupt_rate = 0.0
        self.drop_rate = 0.0
        self.mute = False
        self.stalled_until_ns = 0
        self._held = b''
        self._device = device
        self._rng = np.random.default_rng(seed)

    def receive(self, data: bytes, now_ns: int) -> None:
        """Pass on the host's bytes."""
        self._held += data
        self._pass_on(now_ns)

    def transmit(self, now_ns: int) -> bytes:
        """Return what is left of the device's bytes."""
        if now_ns < self.stalled_until_ns:
            return b''
        self._pass_on(now_ns)
        data = self._device.transmit(now_ns)
        if self.mute:
            return b''
        if self.corrupt_rate > 0.0:
            data = self._corrupt(data)
        if self.drop_rate > 0.0:
            data = self._drop(data)
        return data

    def next_event_ns(self) -> int | None:
        """Return the device's next event."""
        return self.stalled_until_ns if self._held else self._device.next_event_ns()

    def _pass_on(self, now_ns: int) -> None:
        if self._held and now_ns >= self.stalled_until_ns:
            held, self._held = self._held, b''
            self._device.receive(held, now_ns)

    def _corrupt(self, data: bytes) -> bytes:
        sound = np.frombuffer(data, np.uint8)
        bits = np.left_shift(1, self._rng.integers(0, 8, sound.size)).astype(np.uint8)
        hit = self._rng.random(sound.size) < self.corrupt_rate
        return np.where(hit, sound ^ bits, sound).astype(np.uint8).tobytes()

    def _drop(self, data: bytes) -> bytes:
        sound = np.frombuffer(data, np.uint8)
        return sound[self._rng.random(sound.size) >= self.drop_rate].tobytes()

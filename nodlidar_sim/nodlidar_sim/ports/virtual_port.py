"""Serial ports in virtual time, without threads, files or waiting."""

import errno

from nodlidar_common.errors import PortError
from nodlidar_sim.devices.device import Device
from nodlidar_sim.ports.byte_buffer import BoundedBuffer
from serial import SerialException


class VirtualClock:
    """A clock that virtual ports advance instead of waiting; call it for the host time [ns]."""

    def __init__(self, now_ns: int = 0) -> None:
        self.now_ns = now_ns

    def __call__(self) -> int:
        """Return the host time [ns]."""
        return self.now_ns

    def advance_to(self, time_ns: int) -> None:
        """Advance to a time [ns]; a past time has no effect."""
        self.now_ns = max(self.now_ns, time_ns)


class VirtualPort:
    """A device's port in virtual time, with the part of pyserial's ``Serial`` that drivers use.

    Waiting advances the clock from event to event of this device. Devices that share the clock
    catch up when their own port is used.
    """

    def __init__(self, device: Device, clock: VirtualClock, timeout: float | None = None) -> None:
        self._timeout = timeout
        self.is_open = True
        self._device = device
        self._clock = clock
        self._unplugged = False
        self._buffer = BoundedBuffer()

    @property
    def timeout(self) -> float | None:
        """Longest wait of one read [s]; 0 does not wait, None waits without limit.

        Setting it fails on an unplugged port, since a real port is then configured again.
        """
        return self._timeout

    @timeout.setter
    def timeout(self, timeout: float | None) -> None:
        self._timeout = timeout
        if self._unplugged and self.is_open:
            raise SerialException('Could not configure port: Input/output error')

    @property
    def dropped(self) -> int:
        """Number of bytes dropped because the host did not read them."""
        return self._buffer.dropped

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read without waiting; OSError when unplugged, as on a real port."""
        self._check_open()
        if self._unplugged:
            raise OSError(errno.EIO, 'Input/output error')
        self._collect()
        return len(self._buffer)

    def read(self, size: int = 1) -> bytes:
        """Return `size` bytes, or fewer after the timeout.

        Raises
        ------
        serial.SerialException
            If the port is closed or unplugged.
        PortError
            If the wait is unlimited and the device has no event pending.
        """
        self._check_usable()
        deadline = None if self._timeout is None else self._clock() + round(self._timeout * 1e9)
        self._collect()
        while len(self._buffer) < size and self._wait(deadline):
            self._collect()
        data = self._buffer.peek(size)
        self._buffer.discard(len(data))
        return data

    def write(self, data: bytes) -> int:
        """Send bytes to the device and return how many."""
        self._check_usable()
        self._collect()
        self._device.receive(bytes(data), self._clock())
        return len(data)

    def flush(self) -> None:
        """Do nothing: written bytes have been sent."""

    def reset_input_buffer(self) -> None:
        """Discard the bytes that have arrived."""
        self._check_usable()
        self._collect()
        self._buffer.clear()

    def close(self) -> None:
        """Close the port; the device's further bytes are lost."""
        self.is_open = False
        self._buffer.clear()

    def unplug(self) -> None:
        """Unplug the cable: from now on, every call fails as on a real port."""
        self._unplugged = True
        self._buffer.clear()

    def _collect(self) -> None:
        """Read the bytes that the device has sent by now."""
        self._buffer.append(self._device.transmit(self._clock()))

    def _wait(self, deadline: int | None) -> bool:
        """Advance to the next event, or to the deadline [ns] and return False."""
        event = self._device.next_event_ns()
        if event is None and deadline is None:
            raise PortError('read would wait for ever: the device has no event pending')
        if event is None or (deadline is not None and event > deadline):
            self._clock.advance_to(deadline if deadline is not None else self._clock())
            return False
        self._clock.advance_to(event)
        return True

    def _check_open(self) -> None:
        if not self.is_open:
            raise SerialException('the port is closed')

    def _check_usable(self) -> None:
        self._check_open()
        if self._unplugged:
            raise SerialException('device reports readiness to read but returned no data')

"""Serial ports in virtual time: emulated devices without threads, files or waiting."""

import errno

from nodlidar_common.errors import PortError
from nodlidar_sim.devices.device import Device
from nodlidar_sim.ports.byte_buffer import BoundedBuffer
from serial import SerialException


class VirtualClock:
    """A clock that moves when a virtual port waits; call it for host time [ns]."""

    def __init__(self, now_ns: int = 0) -> None:
        self.now_ns = now_ns

    def __call__(self) -> int:
        """Return the host time [ns]."""
        return self.now_ns

    def advance_to(self, time_ns: int) -> None:
        """Move on to a time [ns]; one that has passed changes nothing."""
        self.now_ns = max(self.now_ns, time_ns)


class VirtualPort:
    """A device's port in virtual time, with the calls of pyserial's ``Serial`` that drivers make.

    Waiting advances the clock from event to event of this device. Devices that share a clock
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
        """Longest wait of one read [s]; 0 does not wait, None waits for ever.

        Setting it configures a real port anew, which fails when that is unplugged.
        """
        return self._timeout

    @timeout.setter
    def timeout(self, timeout: float | None) -> None:
        self._timeout = timeout
        if self._unplugged and self.is_open:
            raise SerialException('Could not configure port: Input/output error')

    @property
    def dropped(self) -> int:
        """Bytes lost because the host did not read them."""
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
            If the wait is endless and the device has nothing coming up.
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
        """Do nothing: what is written has been sent."""

    def reset_input_buffer(self) -> None:
        """Forget the bytes that have arrived."""
        self._check_usable()
        self._collect()
        self._buffer.clear()

    def close(self) -> None:
        """Close the port; what the device sends from now on is lost."""
        self.is_open = False
        self._buffer.clear()

    def unplug(self) -> None:
        """Pull the cable: from now on every call fails as it does on a real port."""
        self._unplugged = True
        self._buffer.clear()

    def _collect(self) -> None:
        """Take over what the device has sent by now."""
        self._buffer.append(self._device.transmit(self._clock()))

    def _wait(self, deadline: int | None) -> bool:
        """Advance to the next event; False, at the deadline, if there is none before it."""
        event = self._device.next_event_ns()
        if event is None and deadline is None:
            raise PortError('read would wait for ever: the device has nothing to send')
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

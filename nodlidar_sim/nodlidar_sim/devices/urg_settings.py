"""What the commands SS, CR and HS set in an emulated URG-04LX."""

from nodlidar_sim.devices.urg_clock import UrgClock
from nodlidar_sim.devices.urg_requests import CommandError, number

_BIT_RATES = (19200, 38400, 57600, 115200, 250000, 500000, 750000)
_DEFAULT_BIT_RATE = 19200


class UrgSettings:
    """Bit rate, motor speed and sensitivity.

    Parameters
    ----------
    clock
        Holds the motor speed.

    Attributes
    ----------
    bit_rate
        As set by SS [bit/s]; reported by II, without effect over USB.
    high_sensitivity
        As set by HS; without effect.
    """

    def __init__(self, clock: UrgClock) -> None:
        self.bit_rate = _DEFAULT_BIT_RATE
        self.high_sensitivity = False
        self._clock = clock

    def reset(self) -> None:
        """Restore bit rate and motor speed."""
        self._clock.speed = self._clock.model.speed
        self.bit_rate = _DEFAULT_BIT_RATE

    def set(self, command: bytes, parameters: bytes) -> None:
        """Execute SS, CR or HS; raises CommandError."""
        {b'SS': self._set_bit_rate, b'CR': self._set_speed, b'HS': self._set_sensitivity}[command](
            parameters
        )

    def _set_bit_rate(self, parameters: bytes) -> None:
        bit_rate = number(parameters, b'01')
        if bit_rate not in _BIT_RATES:
            raise CommandError(b'02')
        if bit_rate == self.bit_rate:
            raise CommandError(b'03')
        self.bit_rate = bit_rate

    def _set_speed(self, parameters: bytes) -> None:
        level = number(parameters, b'01')
        if level > 10 and level != 99:
            raise CommandError(b'02')
        # The specification does not define the levels: 1 % each here.
        speed = round(self._clock.model.speed * (1.0 - (level % 99) / 100.0))
        if speed == self._clock.speed:
            raise CommandError(b'03')
        self._clock.speed = speed

    def _set_sensitivity(self, parameters: bytes) -> None:
        if parameters not in (b'0', b'1'):
            raise CommandError(b'01')
        high = parameters == b'1'
        if high == self.high_sensitivity:
            raise CommandError(b'02')
        self.high_sensitivity = high

"""What the commands SS, CR and HS set in an emulated URG-04LX."""

from nodlidar_sim.devices.urg_clock import UrgClock
from nodlidar_sim.devices.urg_identity import STANDARD_SPEED
from nodlidar_sim.devices.urg_requests import CommandError, number

_BIT_RATES = (19200, 38400, 57600, 115200, 250000, 500000, 750000)


class UrgSettings:
    """Bit rate, speed of the motor and sensitivity.

    Parameters
    ----------
    clock
        Has the motor.
    bit_rate
        At power-up [bit/s].

    Attributes
    ----------
    bit_rate
        As SS set it; over USB it has no effect [bit/s].
    high_sensitivity
        As HS set it.
    """

    def __init__(self, clock: UrgClock, bit_rate: int) -> None:
        self.bit_rate = self._default_bit_rate = bit_rate
        self.high_sensitivity = False
        self._clock = clock

    def reset(self) -> None:
        """Set bit rate and speed as at power-up."""
        self._clock.speed = STANDARD_SPEED
        self.bit_rate = self._default_bit_rate

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
        speed = round(STANDARD_SPEED * (1.0 - (level % 99) / 100.0))  # 1 % a level: our choice
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

"""One servo on its bus: set-up, one block read and one block write per cycle, torque."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
import struct

from nodlidar_common.errors import DeviceError, ParameterError
from nodlidar_common.serial_port import SerialPort
from nodlidar_servo.config import ServoConfig
from nodlidar_servo.dynamixel_bus import DynamixelBus
from nodlidar_servo.models import load_share, MODELS, Register
from nodlidar_servo.positions import PositionCheck
from nodlidar_servo.replies import (
    LateReplyError,
    NoAnswerError,
    RefusedError,
    Reply,
    ReplyError,
)
from nodlidar_servo.sample import Sample
from nodlidar_servo.sample_time import excess_ns, sample_time_ns, UsualExcess, WireTime

_EEPROM = struct.Struct('<H3xBHHxBBBHBxB')  # 0..18, see _set_up
_PRESENT = struct.Struct('<HHHBB')  # 36..43: position, speed, load, voltage, temperature
_DRIVE = struct.Struct('<HH')  # 30..33: goal, moving speed
_RETURN_DELAY_UNIT_NS = 2000
_REPLY_TO_ALL = 2
_ATTEMPTS_TO_STOP = 8
_SPARE = 6  # 44..49 may be read, too
_TRIALS = 8  # reads that measure how long the adapter holds replies back
_USUAL_FOR = 0.5  # s; replies that have been late for so long are usual


@dataclass(frozen=True, slots=True)
class Limits:
    """The motor's own limits: temperature [deg C], voltages [V], status bits that shut it down."""

    temperature: int
    voltage_min: float
    voltage_max: float
    shutdown: int


class Servo:
    """Sets a servo up, measures and drives it.

    Parameters
    ----------
    stream
        Open port.
    config
        The configuration.
    clock
        Returns the host time [ns].

    Attributes
    ----------
    limits
        The motor's own limits; set by :meth:`connect`.
    shut_down
        The status bits for which the motor has cut its torque since it was set up; it stays
        without torque until it is set up again.
    """

    def __init__(self, stream: SerialPort, config: ServoConfig, clock: Callable[[], int]) -> None:
        self._bus = DynamixelBus(stream, config.servo_id, config.baud_rate, clock)
        self._config = config
        self._scale = config.scale
        self._torque: bool | None = None
        self._is_connected = False
        self._positions = PositionCheck(self._scale.model, config.acceleration)
        self.shut_down = 0

    def connect(self) -> None:
        """Set the servo up, with its torque off.

        Raises
        ------
        DeviceError
            If the servo does not answer, is another model, or its own limits exclude those of
            the mount.
        """
        self.limits = self._set_up()
        self._delay_ns = self._return_delay_ns()
        self._usual = UsualExcess(
            self._latency_timer_ns(), round(_USUAL_FOR * self._config.feedback_rate)
        )
        self._is_connected = True

    def _set_up(self) -> Limits:
        number, delay, cw, ccw, *limits, torque, level, shutdown = self._read_eeprom()
        self._check_model(number)
        if level != _REPLY_TO_ALL:
            self._have_writes_confirmed()
        self.set_torque(False)
        self._check_angle_limits(cw, ccw)
        if delay != 0:  # the EEPROM wears out
            self._clear_return_delay()
        if torque == 0:
            raise DeviceError('the maximum torque of the servo (address 14) is 0: it cannot move')
        self._torque_limit = round(self._config.torque_limit * torque).to_bytes(2, 'little')
        self._write_torque_limit()
        hottest, lowest, highest = limits
        return Limits(hottest, lowest / 10.0, highest / 10.0, shutdown)

    def _read_eeprom(self) -> tuple[int, ...]:
        try:
            eeprom = self._bus.read(Register.MODEL, _EEPROM.size)
        except NoAnswerError:  # it may be set to answer nothing but pings
            self._post_return_level()
            eeprom = self._bus.read(Register.MODEL, _EEPROM.size)
        return _EEPROM.unpack(eeprom.data)

    def _write_torque_limit(self) -> None:
        """Write the torque limit, which also revives a motor that has shut itself down."""
        self._bus.write(Register.TORQUE_LIMIT, self._torque_limit)

    def _have_writes_confirmed(self) -> None:
        self._post_return_level()
        level = self._bus.read(Register.RETURN_LEVEL, 1).data[0]
        if level != _REPLY_TO_ALL:
            raise DeviceError(
                f'the servo confirms no writes (its status return level, address 16, is {level})'
                ' and is locked: switch its power off and on'
            )

    def _post_return_level(self) -> None:
        self._bus.post(Register.RETURN_LEVEL, bytes([_REPLY_TO_ALL]))

    def _clear_return_delay(self) -> None:
        """Write the EEPROM; if that is locked, the delay stays and the stamps allow for it."""
        with suppress(RefusedError):
            self._bus.write(Register.RETURN_DELAY, bytes([0]))

    def _check_model(self, number: int) -> None:
        if number != self._scale.model.number:
            found = next((m.name for m in MODELS.values() if m.number == number), 'unknown')
            raise DeviceError(
                f"'model' is {self._config.model}, but the servo with ID {self._config.servo_id}"
                f' has model number {number} ({found})'
            )

    def _check_angle_limits(self, cw: int, ccw: int) -> None:
        if cw == ccw == 0:
            raise DeviceError(
                'the servo is in wheel mode: set its CW and CCW angle limits (addresses 6 and 8)'
            )
        if cw > ccw:
            raise DeviceError(
                f'the CW angle limit of the servo (address 6), {cw}, is above its CCW one, {ccw}'
            )
        for key in ('pitch_lower_limit', 'pitch_upper_limit'):
            pitch = getattr(self._config, key)
            if not cw <= self._scale.tick(pitch) <= ccw:
                low, high = sorted((self._scale.pitch(cw), self._scale.pitch(ccw)))
                limit = f'between {low:.4f} and {high:.4f} rad, the angle limits set in the servo'
                raise DeviceError(str(ParameterError(key, limit, pitch)))

    def _return_delay_ns(self) -> int:
        delay = self._bus.read(Register.RETURN_DELAY, 1).data[0]
        return delay * _RETURN_DELAY_UNIT_NS

    def _latency_timer_ns(self) -> int:
        """Return how long the adapter holds replies back, by requests that follow at once."""
        return max(min(self._excess_ns(self._read_present()) for _ in range(_TRIALS)), 0)

    @property
    def torque(self) -> bool:
        """Whether the torque is on, or the motor has not confirmed that it is off."""
        return self._torque is not False

    def read(self) -> Sample:
        """Measure once, in one transaction; raises DeviceError."""
        reply = self._read_present()
        position, speed, load, voltage, temperature = _PRESENT.unpack(reply.data)
        self.shut_down |= reply.status & self.limits.shutdown
        stamp_ns = self._stamp(reply)
        self._positions.accept(stamp_ns, position)
        return Sample(
            stamp_ns=stamp_ns,
            pitch=self._scale.pitch(position),
            velocity=self._scale.sign * self._scale.model.velocity(speed),
            load=self._scale.sign * load_share(load),
            voltage=voltage / 10.0,
            temperature=temperature,
            status=reply.status,
        )

    def _read_present(self) -> Reply:
        return self._bus.read(Register.PRESENT, _PRESENT.size, _SPARE)

    def _stamp(self, reply: Reply) -> int:
        if not self._usual.add(self._excess_ns(reply)):
            raise LateReplyError(
                'the reply of the servo is too late: the time of the measurement is unknown'
            )
        return sample_time_ns(reply.sent_ns, reply.received_ns, self._wire(reply))

    def _excess_ns(self, reply: Reply) -> int:
        return excess_ns(reply.sent_ns, reply.received_ns, self._wire(reply))

    def _wire(self, reply: Reply) -> WireTime:
        return WireTime.of_read(reply.size, self._config.baud_rate, self._delay_ns)

    def drive(self, pitch: float, speed: float) -> None:
        """Send the servo to a pitch [rad] at a speed [rad/s], torque on; raises DeviceError.

        The goal is sent without confirmation: it is repeated every cycle, and a reply would double
        the time on the bus.
        """
        goal = _DRIVE.pack(self._scale.tick(pitch), self._scale.model.speed_counts(speed))
        self._bus.post(Register.GOAL, goal)
        if self._torque is not True:
            if not self.shut_down:
                self._write_torque_limit()  # it may have been reset
            self.set_torque(True)

    def set_torque(self, on: bool) -> None:
        """Switch the torque, confirmed by the motor; raises DeviceError."""
        self._torque = None
        self._bus.write(Register.TORQUE_ENABLE, bytes([on]))
        self._torque = on

    def disconnect(self) -> None:
        """Switch the torque off, unless connecting failed, which leaves it off.

        Raises
        ------
        DeviceError
            If the motor does not confirm it.
        PortError
            If the port fails.
        """
        if not self._is_connected:
            return
        for _ in range(_ATTEMPTS_TO_STOP):
            with suppress(ReplyError):
                self.set_torque(False)
                return
        raise DeviceError('the servo did not confirm that its torque is off')

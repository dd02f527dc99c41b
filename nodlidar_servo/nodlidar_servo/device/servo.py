"""One servo on its bus: set-up, one block read and one block write per cycle, torque."""

from collections.abc import Callable
from contextlib import suppress

from nodlidar_common.errors import DeviceError
from nodlidar_common.serial_port import SerialPort
from nodlidar_common.stamps import NS_PER_S
from nodlidar_servo.bus.dynamixel_bus import DynamixelBus
from nodlidar_servo.bus.replies import LateReplyError, NoAnswerError, Reply, ReplyError
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.positions import PositionCheck
from nodlidar_servo.device.preparation import (
    hardware_errors,
    LONGEST_SILENCE,
    prepare,
    set_watchdog,
    write_position_gain,
    write_torque_limit,
)
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.device.sample_time import excess_ns, sample_time_ns, UsualExcess, WireTime

_ATTEMPTS_TO_STOP = 8
_SPARE = 6  # bytes before those that measure may be read, too
_TRIALS = 8  # reads that measure how long the adapter holds replies back
_MISSED_BY_RESET = 3  # answers in a row; a servo that starts anew takes longer than that
_SURE = 3  # replies in a row that say that the motor has shut down
_USUAL_FOR = 0.5  # s; replies that have been late for this long are usual


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
        self._config, self._scale = config, config.scale
        self._table = self._scale.model.table
        self._bus = DynamixelBus(
            stream, config.servo_id, config.baud_rate, clock, self._table.packets
        )
        self._torque: bool | None = None
        self._is_connected = False
        self._missed = self._asked_ns = 0
        # The configured acceleration is what the servo reaches at least. It may do more, so a low
        # one is no bound for its positions; the default is, as for any servo.
        strongest = max(config.acceleration, ServoConfig.acceleration)
        self._positions = PositionCheck(self._scale.model, strongest)
        self.shut_down = 0

    def connect(self) -> None:
        """Set the servo up, with its torque off.

        Raises
        ------
        DeviceError
            If the servo does not answer, is another model, or its own limits exclude those of
            the mount.
        """
        self._torque = None
        self._setting = prepare(self._bus, self._config)
        self._torque, self.limits = False, self._setting.limits
        self._usual = UsualExcess(
            self._latency_timer_ns(), round(_USUAL_FOR * self._config.feedback_rate)
        )
        self._is_connected = True

    def _latency_timer_ns(self) -> int:
        """Return how long the adapter holds replies back, by requests that follow at once."""
        return max(min(self._excess_ns(self._read_present()) for _ in range(_TRIALS)), 0)

    @property
    def torque(self) -> bool:
        """Whether the torque is on, or the motor has not confirmed that it is off."""
        return self._torque is not False

    def read(self) -> Sample:
        """Measure, in one transaction unless the motor seems to have shut down.

        Raises
        ------
        DeviceError
            If that fails.
        """
        reply, status = self._read_with_alarms()
        present, model = self._table.parse_present(reply.data), self._scale.model
        stamp_ns = self._stamp(reply)
        self._positions.accept(stamp_ns, present.position)
        return Sample(
            stamp_ns=stamp_ns,
            pitch=self._scale.pitch(present.position),
            velocity=self._scale.sign * present.speed * model.speed_unit,
            load=self._scale.sign * present.load / model.most_load,
            voltage=present.voltage,
            temperature=present.temperature,
            status=status,
        )

    def _read_with_alarms(self) -> tuple[Reply, int]:
        """Return a reply and its status bits; note a shutdown that several replies in a row say.

        A shutdown is final, and the sums of Protocol 1.0 and of STS do not show that bytes were
        swapped, which can look like an alarm.
        """
        shut_down = self.limits.shutdown & ~self.shut_down
        for _ in range(_SURE):
            reply = self._read_present()
            status = self._status(reply)
            shut_down &= status
            if not shut_down:
                break
        self.shut_down |= shut_down
        return reply, status

    def _status(self, reply: Reply) -> int:
        if 'errors' not in self._table.registers:
            return self._table.packets.alarms(reply.status)
        has_alarm = self._table.packets.has_alarm(reply.status)
        return hardware_errors(self._bus, self._table) if has_alarm else 0

    def _read_present(self) -> Reply:
        try:
            reply = self._bus.read(self._table.present, self._table.present_size, _SPARE)
        except NoAnswerError:
            self._missed += 1
            raise
        was_reset = self._missed >= _MISSED_BY_RESET  # its supply may have dipped
        was_stopped = reply.sent_ns - self._asked_ns > LONGEST_SILENCE * NS_PER_S  # its watchdog
        if (was_reset or was_stopped) and self._torque:
            self._torque = None  # it may have lost its torque and what was set
        self._missed, self._asked_ns = 0, reply.sent_ns
        return reply

    def _stamp(self, reply: Reply) -> int:
        wire = self._wire(reply)
        if not self._usual.add(excess_ns(reply.sent_ns, reply.received_ns, wire)):
            raise LateReplyError(
                'the reply of the servo is too late: the time of the measurement is unknown'
            )
        return sample_time_ns(reply.sent_ns, reply.received_ns, wire)

    def _excess_ns(self, reply: Reply) -> int:
        return excess_ns(reply.sent_ns, reply.received_ns, self._wire(reply))

    def _wire(self, reply: Reply) -> WireTime:
        return WireTime.of_read(
            reply.request_size, reply.size, self._config.baud_rate, self._setting.return_delay_ns
        )

    def drive(self, pitch: float, speed: float) -> None:
        """Send the servo to a pitch [rad] at a speed [rad/s], torque on; raises DeviceError.

        The goal is sent without confirmation: it is repeated every cycle, and a reply would double
        the time on the bus. A motor that has shut down gets none: an STS3215 would start again.
        """
        if self.shut_down:
            return
        has_torque = self._torque is True
        if not has_torque:
            set_watchdog(self._bus, self._table, on=True)
            self._torque = None  # the goal switches it on, if the servo is an RX or AX
        speed_counts = self._scale.model.speed_counts(speed)
        goal = self._table.goal(self._scale.tick(pitch), speed_counts)
        self._bus.post(self._table.drive, goal)
        if not has_torque:
            # They may have been reset.
            write_position_gain(self._bus, self._table, self._setting.position_gain)
            write_torque_limit(self._bus, self._table, self._setting.torque_limit)
            self.set_torque(True)

    def set_torque(self, on: bool) -> None:
        """Switch the torque, confirmed by the motor; raises DeviceError."""
        self._torque = None
        self._bus.write(*self._table.encoded('torque', on))
        self._torque = on

    def disconnect(self) -> None:
        """Switch the torque off, unless connecting failed.

        Connecting switches it off once it knows the model, and never on. A servo that it fails on
        before, such as another model, keeps its torque.

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
                if self.torque:
                    self.set_torque(False)
                set_watchdog(self._bus, self._table, on=False)
                return
        if self.torque:
            raise DeviceError('the servo did not confirm that its torque is off')

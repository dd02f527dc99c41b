"""Reads and writes one servo that was found: its condition, torque off, changes read back."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from nodlidar_servo.bus.packets import Answer
from nodlidar_servo.bus.replies import NoAnswerError, RefusedError, ReplyError
from nodlidar_servo.setup.changes import Change
from nodlidar_servo.setup.condition import Condition
from nodlidar_servo.setup.errors import LockedError, NotWrittenError, SharedIdError
from nodlidar_servo.setup.registers import HEAD, protocol_of, rate_of, registers_of
from nodlidar_servo.setup.search import (
    answers,
    exchange,
    Found,
    is_shared,
    OpenAt,
    OVERHEADS,
    READ,
    reply_wait,
    WRITE,
)

_ATTEMPTS = 4


class Session:
    """One servo on its bus.

    Parameters
    ----------
    open_at
        Opens the port at a bit rate.
    found
        The servo.

    Attributes
    ----------
    found
        Where the servo answers now.
    """

    def __init__(self, open_at: OpenAt, found: Found) -> None:
        self.found, self._open_at = found, open_at
        with suppress(ReplyError):  # STS servos answer reads always
            number = found.packets.number
            head = self._ask(READ, number(0) + number(HEAD), HEAD).data
            self.found = replace(found, packets=protocol_of(found.packets, head))
        self._table = registers_of(self.found.packets)

    def check_alone(self) -> None:
        """Raise SharedIdError if two servos seem to have this ID."""
        found, table = self.found, self._table
        with self._open_at(found.baud_rate) as port:
            if is_shared(port, found, table.present, table.present_size):
                raise SharedIdError(
                    f'replies of ID {found.servo_id} at {found.baud_rate} bit/s are broken or'
                    ' double: two servos have this ID, or the line is disturbed. Leave one servo'
                    ' connected and run setup with another --servo-id for it, then connect the'
                    ' next; with one servo, check the cable'
                )

    def condition(self) -> Condition:
        """Return the servo's registers.

        Raises
        ------
        ReplyError
            If it does not answer; if it answers only pings, :meth:`make_it_answer` changes that.
        """
        number, size = self.found.packets.number, self._table.size
        answer = self._ask(READ, number(0) + number(size), size)
        return Condition(self.found, self._table.values(answer.data), answer.status)

    def make_it_answer(self) -> None:
        """Switch the torque off and have all requests answered, neither with a confirmation.

        Lower return levels send none, and torque locks the settings of some models.
        """
        for name, value in (('torque', 0), ('return level', self._table.reply_to_all)):
            with suppress(ReplyError):
                self._put(name, value, attempts=1)

    def torque_off(self) -> None:
        """Switch the torque off; raises ReplyError if the servo does not confirm it."""
        self._put('torque', 0)

    def write(self, changes: Sequence[Change]) -> None:
        """Write changes in their order, each read back, with the torque off.

        Raises
        ------
        LockedError
            If the servo's settings are locked.
        NotWrittenError
            If a register does not have the value that was written.
        ReplyError
            If the servo does not answer any more.
        """
        before = self.condition().values
        if before.get('lock'):
            raise LockedError(
                'the settings of the servo are locked (address 47): switch its power off and on'
            )
        if before['return level'] != self._table.reply_to_all:
            self.make_it_answer()
        self.torque_off()
        self._lock(False, before)
        try:
            for change in changes:
                self._write(change)
        except BaseException:  # Ctrl-C, too
            with suppress(ReplyError):
                self._lock(True, before)
            raise
        self._lock(True, before)

    def _lock(self, locked: bool, before: Mapping[str, int]) -> None:
        """Lock or unlock the EEPROM of a servo that forgets changes made while it is locked."""
        if 'EEPROM lock' in before:
            self._put('EEPROM lock', int(locked))

    def _write(self, change: Change) -> None:
        address = self._table.address(change.name)
        moves = change.name in ('ID', 'bit rate')  # its confirmation may come from the new place
        try:
            self._put(change.name, change.after, attempts=1 if moves else _ATTEMPTS)
        except NoAnswerError:
            if not moves:
                raise
        if change.name == 'ID':
            self.found = replace(self.found, servo_id=change.after)
        if change.name == 'bit rate':
            rate = rate_of(self.found.packets, change.after)
            self.found = replace(self.found, baud_rate=rate)
        try:
            value = self.condition().values[change.name]
        except NoAnswerError as error:
            raise NotWrittenError(
                f'after writing {change.name} = {change.after} (address {address}) the servo does'
                ' not answer there: switch its power off and on, then run setup again'
            ) from error
        if value != change.after:
            raise NotWrittenError(
                f'{change.name} (address {address}) is {value} after {change.after} was written'
            )

    def _put(self, name: str, value: int, attempts: int = _ATTEMPTS) -> None:
        """Write a register; a request may be repeated when its reply is lost."""
        address, data = self._table.encoded(name, value)
        self._ask(WRITE, self.found.packets.number(address) + data, 0, attempts)

    def _ask(
        self, instruction: int, parameters: bytes, size: int, attempts: int = _ATTEMPTS
    ) -> Answer:
        """Return the answer to a request, with `size` bytes of data."""
        found = self.found
        request = found.servo_id, instruction, parameters
        wait, whole = (
            reply_wait(found.baud_rate, size + OVERHEADS),
            size + found.packets.answer_overhead,
        )
        with self._open_at(found.baud_rate) as port:
            for _ in range(attempts):
                received = exchange(port, found.packets, request, wait, whole)
                for answer in answers(found.packets, received):
                    if answer.servo_id == found.servo_id:
                        return self._accepted(answer, size)
        raise NoAnswerError(f'the servo with ID {found.servo_id} does not answer')

    def _accepted(self, answer: Answer, size: int) -> Answer:
        if len(answer.data) != size:
            reason = self.found.packets.refusal(answer.status) or 'its reply has another length'
            raise RefusedError(f'the servo refused the request: {reason}')
        if not size and (reason := self.found.packets.refusal(answer.status)):
            raise RefusedError(f'the servo refused the request: {reason}')
        return answer

"""Leads through the set-up of one servo: finds it, asks for consent, writes, shows the result."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

from nodlidar_common.errors import DeviceError
from nodlidar_common.parameters import check
from nodlidar_servo.bus.replies import NoAnswerError
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.setup.changes import Change, needed_changes, RETURN_LEVEL
from nodlidar_servo.setup.condition import Condition
from nodlidar_servo.setup.errors import NoServoError, SeveralServosError, WrongModelError
from nodlidar_servo.setup.search import Found, OpenAt, rare_trials, search, Trial, usual_trials
from nodlidar_servo.setup.session import Session


@dataclass(frozen=True, slots=True)
class Wish:
    """What the user asked for.

    Attributes
    ----------
    config
        What the node will ask for; its model is that of the servo that is found.
    model
        The model that the servo must be, empty for any.
    from_id
        The ID of the servo to be set up, if there are several.
    level
        Whether the scan plane is level now, None to ask.
    dry_run
        Whether to write nothing.
    """

    config: ServoConfig = field(default_factory=ServoConfig)
    model: str = ''
    from_id: int | None = None
    level: bool | None = None
    dry_run: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """The servo before and after, what was changed, and what the node must be given."""

    before: Condition
    after: Condition
    changes: Sequence[Change]
    config: ServoConfig


class Dialogue:
    """Asks and shows by two functions, so that it needs no terminal.

    Parameters
    ----------
    open_at
        Opens the port at a bit rate.
    agrees
        Returns whether the user agrees to a change, in words.
    show
        Shows a line.
    tried
        Called after each trial with its number and that of all trials.
    """

    def __init__(
        self,
        open_at: OpenAt,
        agrees: Callable[[str], bool],
        show: Callable[[str], None],
        tried: Callable[[int, int], None] = lambda done, of: None,
    ) -> None:
        self._open_at = open_at
        self._agrees, self._show, self._tried = agrees, show, tried

    def find(self, from_id: int | None) -> tuple[Found, Sequence[Found]]:
        """Return the servo to be set up, and all that answer at its bit rate.

        Raises
        ------
        NoServoError
            If none answers.
        LidarError
            If something streams at the port.
        SeveralServosError
            If several answer and none is chosen.
        """
        found = self._first([*usual_trials(), *rare_trials()])
        if not found:
            raise NoServoError(
                'no servo answers at any bit rate, with any ID, of protocol 1.0 or 2.0: check its'
                ' supply (the LED of a servo blinks at power-on; a U2D2 gives it none), the cable'
                ' and the socket of the adapter (RS-485 or TTL)'
            )
        chosen = [each for each in found if from_id in (None, each.servo_id)]
        if len(chosen) != 1:
            names = ', '.join(str(each.servo_id) for each in found)
            raise SeveralServosError(
                f'the servos with these IDs answer at {found[0].baud_rate} bit/s: {names};'
                ' choose one of them with --from-id'
            )
        return chosen[0], found

    def _first(self, trials: Sequence[Trial]) -> Sequence[Found]:
        for number, found in enumerate(search(self._open_at, trials), 1):
            self._tried(number, len(trials))
            if found:
                return found
        return ()

    def set_up(self, wish: Wish) -> Result:
        """Find a servo and set it up, as far as the user agrees.

        Raises
        ------
        DeviceError
            If the servo cannot be set up; its kind says why.
        PortError
            If the port cannot be used.
        ParameterError
            If the servo cannot do what was asked for, or keeps a bit rate that the node refuses.
        """
        found, others = self.find(wish.from_id)
        session = Session(self._open_at, found)
        session.check_alone()
        before, made = self._condition(session, wish)
        _check_model(before, wish)
        for name, text in before.lines():
            self._show(f'{name:<14}{text}')
        for fault in before.faults():
            self._show(f'WRONG: {fault}')
        config = self._config(session, before, wish)
        changes = needed_changes(before, config)
        if wish.dry_run:
            for change in changes:
                self._show(f'would change {words(change)}')
            return Result(before, before, (), _reached(config, before))
        _check_free(config.servo_id, found, others)
        agreed = self._agreed(changes)
        if agreed and before.values['torque'] and not self._agrees(_SINKS):
            agreed = []
        if agreed:
            _write(session, agreed)
        after = session.condition()
        reached = _reached(config, after)
        check(reached)  # the servo may have kept a bit rate that the node does not have
        return Result(before, after, [*made, *agreed], reached)

    def _agreed(self, changes: Sequence[Change]) -> list[Change]:
        """Return the changes to which the user agrees."""
        agreed = []
        for change in changes:
            if self._agrees(f'change {words(change)}'):
                agreed.append(change)
            elif change.name == RETURN_LEVEL:
                self._show('nothing is changed: at this return level, no write is confirmed')
                return []
        return agreed

    def _condition(self, session: Session, wish: Wish) -> tuple[Condition, list[Change]]:
        """Return how the servo is, and what had to be changed to read that."""
        try:
            return session.condition(), []
        except NoAnswerError:
            request = 'let the servo answer all requests, not only pings (return level 2)'
            if wish.dry_run or not self._agrees(f'{request}; {_SINKS}'):
                raise
            session.make_it_answer()
            condition = session.condition()
            level = condition.values[RETURN_LEVEL]
            return condition, [Change(RETURN_LEVEL, None, level, 'all requests are answered')]

    def _config(self, session: Session, before: Condition, wish: Wish) -> ServoConfig:
        """Return what the node will ask for, with the position at which the plane is level."""
        config = replace(wish.config, model=before.model.name)
        position, middle = before.values['position'], config.scale.zero_tick
        level = wish.level
        if level is None and not wish.dry_run and position != middle:
            level = self._agrees(
                f'take the present position, now {position}, as level instead of {middle}: hold'
                ' the scan plane level, then answer'
            )
        if level:
            config = replace(config, zero_tick=session.condition().values['position'])
        check(config)
        return config


_SINKS = 'switch the torque off: hold the lidar, it may sink'


def _write(session: Session, changes: Sequence[Change]) -> None:
    """Write changes; the torque is off afterwards, also after Ctrl-C."""
    try:
        session.write(changes)
    except BaseException:  # Ctrl-C, too
        with suppress(DeviceError):  # what happened first says more
            session.torque_off()
        raise
    session.torque_off()
    session.check_alone()


def _reached(config: ServoConfig, after: Condition) -> ServoConfig:
    """Return what the node must be given: bit rate and ID as the servo has them."""
    found = after.found
    near = abs(found.baud_rate / config.baud_rate - 1.0) < 0.03
    rate = config.baud_rate if near else found.baud_rate
    return replace(config, baud_rate=rate, servo_id=found.servo_id)


def _check_model(condition: Condition, wish: Wish) -> None:
    name = condition.model.name
    if wish.model not in ('', name):
        raise WrongModelError(f'the servo is a model {name}, not {wish.model}')


def _check_free(servo_id: int, found: Found, others: Sequence[Found]) -> None:
    if servo_id != found.servo_id and any(each.servo_id == servo_id for each in others):
        raise SeveralServosError(
            f'another servo has the ID {servo_id}: choose a free one with --servo-id'
        )


def words(change: Change) -> str:
    """Return a change in words."""
    return f'{change.name} from {change.before} to {change.after} ({change.reason})'

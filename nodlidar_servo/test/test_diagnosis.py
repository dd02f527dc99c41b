from types import SimpleNamespace

from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.preparation import MotorLimits
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.diagnosis import Diagnosis
from nodlidar_servo.nod.nod_commands import NodCommands
from nodlidar_servo.servo_loop import LoopFigures
import pytest

TOO_FAR = ParameterError('pitch_max', 'at most 0.8 rad', 1.2)
SECOND = 1_000_000_000
NOD = Nod(-0.6, 0.6, 0.4, 4001, 0)


def sample(voltage=12.0, temperature=40, status=0):
    return Sample(0, 0.1, 0.0, -0.25, voltage, temperature, status)


def servo(torque=True, shut_down=0):
    return SimpleNamespace(
        torque=torque, shut_down=shut_down, limits=MotorLimits(80, 6.0, 19.0, 36)
    )


@pytest.fixture
def figures():
    return LoopFigures()


@pytest.fixture
def commands():
    commands = NodCommands(ServoConfig(command_timeout=1.0))
    commands.accept(NOD, 0)
    return commands


@pytest.fixture
def following():
    return SimpleNamespace(fault='')


@pytest.fixture
def diagnosis(figures, commands, following):
    diagnosis = Diagnosis(figures, commands, following, 100.0)
    diagnosis.connected(servo(), '')
    diagnosis.cycled(sample(), None)
    return diagnosis


def test_nothing_is_wrong_with_a_servo_that_nods(diagnosis):
    report = diagnosis.next_report(SECOND)
    assert (report.warnings, report.errors) == ((), ())
    assert report.figures['torque'] == 'on'
    assert report.figures['load [share of maximum]'] == '-0.25'
    assert report.figures['command age [s]'] == '1.00'


def test_the_rate_is_that_since_the_last_report(diagnosis, figures):
    diagnosis.next_report(SECOND)
    figures.samples += 130
    diagnosis.cycled(sample(), None)
    report = diagnosis.next_report(3 * SECOND)
    assert report.figures['joint states per second'] == '65.0'
    assert '65.0 joint states per second, not 100' in report.warnings
    figures.samples += 285
    diagnosis.cycled(sample(), None)
    assert not any('per second' in text for text in diagnosis.next_report(6 * SECOND).warnings)


def test_joint_states_that_are_withheld_are_none_but_replies(diagnosis, figures):
    diagnosis.next_report(SECOND)
    figures.samples += 40
    figures.withhold(59)
    figures.failures['no answer'] += 1
    diagnosis.cycled(sample(), None)
    report = diagnosis.next_report(2 * SECOND)
    assert report.figures['joint states per second'] == '40.0'
    assert report.warnings[1:] == (
        '40.0 joint states per second, not 100',
        '1.0% of the replies failed: no answer',
    )


def test_a_new_connection_has_no_rate_yet(diagnosis, figures):
    diagnosis.next_report(SECOND)
    diagnosis.disconnected()
    diagnosis.next_report(2 * SECOND)
    diagnosis.connected(servo(), '')
    figures.samples += 10
    diagnosis.cycled(sample(), None)
    report = diagnosis.next_report(2 * SECOND + SECOND // 2)
    assert report.figures['joint states per second'] == '0.0'
    assert not any('per second' in text for text in report.warnings)


def test_failures_are_counted_by_reason(diagnosis, figures):
    figures.failures['no answer'] += 2
    figures.failures['corrupt reply'] += 1
    diagnosis.cycled(sample(), None)
    counted = diagnosis.next_report(SECOND).figures
    assert counted['failed: no answer'] == '2'
    assert counted['failed: corrupt reply'] == '1'


@pytest.mark.parametrize(
    ('reason', 'count', 'is_told'),
    [('late reply', 10, False), ('late reply', 20, True), ('corrupt reply', 1, True)],
)
def test_any_failure_of_the_bus_and_many_late_replies_are_a_warning(
    diagnosis, figures, commands, reason, count, is_told
):
    diagnosis.next_report(SECOND // 2)
    before = diagnosis.urgent(SECOND // 2)
    commands.accept(NOD, SECOND)
    figures.samples += 150
    figures.failures[reason] += count
    diagnosis.cycled(sample(), None)
    assert (diagnosis.urgent(2 * SECOND) != before) == (reason != 'late reply')
    warnings = diagnosis.next_report(2 * SECOND).warnings
    assert warnings == (f'{count / (150 + count):.1%} of the replies failed: {reason}',) * is_told


@pytest.mark.parametrize(
    ('measured', 'words'),
    [
        (sample(voltage=5.9), 'supply is 5.9 V, outside 6.0 to 19.0 V'),
        (sample(voltage=19.1), 'supply is 19.1 V'),
        (sample(temperature=80), 'motor is at 80 deg C, limit 80'),
    ],
)
def test_what_is_beyond_the_motors_own_limits_is_a_warning(diagnosis, measured, words):
    diagnosis.cycled(measured, None)
    (warning,) = diagnosis.next_report(SECOND).warnings
    assert words in warning


def test_every_alarm_of_the_motor_is_an_error(diagnosis):
    diagnosis.cycled(sample(status=0x25), None)
    (error,) = diagnosis.next_report(SECOND).errors
    assert error == 'the servo reports: input voltage, overheating, overload'


def test_a_motor_that_has_shut_down_is_an_error_also_when_the_cause_is_gone(diagnosis):
    diagnosis.connected(servo(shut_down=0x20), '')
    diagnosis.cycled(sample(), None)
    (error,) = diagnosis.next_report(SECOND).errors
    assert error == 'the servo has shut down (overload): deactivate and activate the node'


def test_a_slow_adapter_a_refusal_and_silence_are_warnings(diagnosis, commands):
    diagnosis.connected(servo(torque=False), 'slow')
    commands.refuse(TOO_FAR, 0)
    warnings = diagnosis.next_report(5 * SECOND).warnings
    assert warnings == (
        f'nod command refused: {TOO_FAR}',
        'no nod command to follow: torque off',
        'slow',
    )


def test_a_servo_that_is_gone_leaves_only_what_was_counted(diagnosis):
    diagnosis.disconnected()
    report = diagnosis.next_report(9 * SECOND)
    assert 'voltage [V]' not in report.figures
    assert (report.warnings, report.errors) == ((), ())


def test_a_refusal_is_a_warning_even_if_good_commands_follow_but_only_once(diagnosis, commands):
    commands.refuse(TOO_FAR, 0)
    commands.accept(NOD, 0)
    assert diagnosis.next_report(SECOND).warnings == (f'nod command refused: {TOO_FAR}',)
    assert diagnosis.next_report(SECOND).warnings == ()


def test_a_servo_that_goes_away_takes_its_own_figures_along(diagnosis):
    state = diagnosis.state
    assert diagnosis.next_report(SECOND).figures['torque'] == 'on'
    diagnosis.disconnected()
    assert state.link.torque  # what another thread still reads has not changed
    assert 'torque' not in diagnosis.next_report(2 * SECOND).figures

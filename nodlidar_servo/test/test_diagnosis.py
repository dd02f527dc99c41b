from types import SimpleNamespace

from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NodTrajectory
from nodlidar_servo.config import ServoConfig
from nodlidar_servo.diagnosis import Diagnosis
from nodlidar_servo.nod_commands import NodCommands
from nodlidar_servo.sample import Sample
from nodlidar_servo.servo import Limits
from nodlidar_servo.servo_loop import LoopFigures
import pytest

TOO_FAR = ParameterError('pitch_max', 'at most 0.8 rad', 1.2)
SECOND = 1_000_000_000
NOD = NodTrajectory(-0.6, 0.6, 0.4, 4001, 0)


def sample(voltage=12.0, temperature=40, status=0):
    return Sample(0, 0.1, 0.0, -0.25, voltage, temperature, status)


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
    diagnosis.connected(
        SimpleNamespace(torque=True, shut_down=0, limits=Limits(80, 6.0, 19.0, 36)), ''
    )
    diagnosis.sample = sample()
    return diagnosis


def test_nothing_is_wrong_with_a_servo_that_nods(diagnosis):
    figures, warnings, errors = diagnosis.report(SECOND)
    assert (warnings, errors) == ([], [])
    assert figures['torque'] == 'on'
    assert figures['load [share of maximum]'] == '-0.25'
    assert figures['command age [s]'] == '1.00'


def test_the_rate_is_that_since_the_last_report(diagnosis, figures):
    diagnosis.report(SECOND)
    figures.samples += 130
    report = diagnosis.report(3 * SECOND)
    assert report[0]['joint states per second'] == '65.0'
    assert '65.0 joint states per second, not 100' in report[1]
    figures.samples += 285
    assert not any('per second' in text for text in diagnosis.report(6 * SECOND)[1])


def test_failures_are_counted_by_reason(diagnosis, figures):
    figures.failures['no answer'] += 2
    figures.failures['corrupt reply'] += 1
    report = diagnosis.report(SECOND)[0]
    assert report['failed: no answer'] == '2'
    assert report['failed: corrupt reply'] == '1'


@pytest.mark.parametrize(
    ('reason', 'count', 'is_told'),
    [('late reply', 10, False), ('late reply', 20, True), ('corrupt reply', 1, True)],
)
def test_any_failure_of_the_bus_and_many_late_replies_are_a_warning(
    diagnosis, figures, commands, reason, count, is_told
):
    diagnosis.report(SECOND // 2)
    before = diagnosis.urgent(SECOND // 2)
    commands.accept(NOD, SECOND)
    figures.samples += 150
    figures.failures[reason] += count
    assert (diagnosis.urgent(2 * SECOND) != before) == (reason != 'late reply')
    warnings = diagnosis.report(2 * SECOND)[1]
    assert warnings == [f'{count / (150 + count):.1%} of the replies failed: {reason}'] * is_told


@pytest.mark.parametrize(
    ('measured', 'words'),
    [
        (sample(voltage=5.9), 'supply is 5.9 V, outside 6.0 to 19.0 V'),
        (sample(voltage=19.1), 'supply is 19.1 V'),
        (sample(temperature=80), 'motor is at 80 deg C, limit 80'),
    ],
)
def test_what_is_beyond_the_motors_own_limits_is_a_warning(diagnosis, measured, words):
    diagnosis.sample = measured
    (warning,) = diagnosis.report(SECOND)[1]
    assert words in warning


def test_every_alarm_of_the_motor_is_an_error(diagnosis):
    diagnosis.sample = sample(status=0x25)
    (error,) = diagnosis.report(SECOND)[2]
    assert error == 'the servo reports: input voltage, overheating, overload'


def test_a_motor_that_has_shut_down_is_an_error_also_when_the_cause_is_gone(diagnosis):
    servo = SimpleNamespace(torque=True, shut_down=0x20, limits=Limits(80, 6.0, 19.0, 36))
    diagnosis.connected(servo, '')
    (error,) = diagnosis.report(SECOND)[2]
    assert error == 'the servo has shut down (overload): deactivate and activate the node'


def test_a_slow_adapter_a_refusal_and_silence_are_warnings(diagnosis, commands):
    diagnosis.connected(
        SimpleNamespace(torque=False, shut_down=0, limits=Limits(80, 6.0, 19.0, 36)), 'slow'
    )
    commands.refuse(TOO_FAR)
    warnings = diagnosis.report(5 * SECOND)[1]
    assert warnings == [
        f'nod command refused: {TOO_FAR}',
        'no nod command to follow: torque off',
        'slow',
    ]


def test_a_servo_that_is_gone_leaves_only_what_was_counted(diagnosis):
    diagnosis.disconnected()
    figures, warnings, errors = diagnosis.report(9 * SECOND)
    assert 'voltage [V]' not in figures
    assert (warnings, errors) == ([], [])


def test_a_refusal_is_a_warning_even_if_good_commands_follow_but_only_once(diagnosis, commands):
    commands.refuse(TOO_FAR)
    commands.accept(NOD, 0)
    assert diagnosis.report(SECOND)[1] == [f'nod command refused: {TOO_FAR}']
    assert diagnosis.report(SECOND)[1] == []


def test_commands_from_two_sides_are_a_warning(diagnosis):
    assert diagnosis.report(SECOND, commanders=2)[1] == ['nod commands come from 2 publishers']


def test_a_servo_that_goes_away_during_a_report_does_no_harm(diagnosis):
    class Vanishing:
        shut_down, limits = 0, Limits(80, 6.0, 19.0, 36)

        @property
        def torque(self):
            diagnosis.disconnected()  # what the device's thread may do at any instant
            return True

    diagnosis.connected(Vanishing(), '')
    assert diagnosis.report(SECOND)[0]['torque'] == 'on'
    assert 'torque' not in diagnosis.report(2 * SECOND)[0]

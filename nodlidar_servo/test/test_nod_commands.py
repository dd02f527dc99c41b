import math

from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_servo.nod.nod_commands import NodCommands
import pytest

SECOND = 1_000_000_000
NOD = Nod(-0.6, 0.6, 0.4, 4001, 0)
OTHER = Nod(-0.5, 0.5, 0.4, 4001, 0)
THIRD = Nod(-0.4, 0.4, 0.4, 4001, 0)
TOO_FAR = Nod(-0.6, 0.9, 0.4, 4001, 0)
FAR = ParameterError('pitch_max', 'at most 0.8 rad', 1.2)
FAST = ParameterError('sweep_duration', 'at least 0.2 s', 0.1)


def test_without_a_command_there_is_nothing_to_follow():
    commands = NodCommands(ServoConfig())
    assert commands.follow(0) is None
    assert commands.age(0) == math.inf


def test_a_command_counts_until_it_is_too_old():
    commands = NodCommands(ServoConfig(command_timeout=0.5))
    commands.accept(NOD, SECOND)
    assert commands.follow(SECOND + SECOND // 2).nod == NOD
    assert commands.follow(SECOND + SECOND // 2 + 1) is None


def test_the_same_command_again_changes_nothing_but_its_age():
    commands = NodCommands(ServoConfig(command_timeout=1.0))
    commands.accept(NOD, 0)
    tracker = commands.follow(0)
    commands.accept(Nod(-0.6, 0.6, 0.4, 4001, 0), SECOND)
    assert commands.follow(2 * SECOND) is tracker
    assert commands.age(2 * SECOND) == 1.0


def test_another_command_takes_over():
    commands = NodCommands(ServoConfig())
    commands.accept(NOD, 0)
    commands.accept(OTHER, 1)
    assert commands.follow(1).nod == OTHER


def test_a_command_for_later_leaves_the_former_one_until_then():
    commands = NodCommands(ServoConfig())
    commands.accept(NOD, 0)
    commands.accept(OTHER, 1, start_ns=SECOND // 2)
    assert commands.follow(SECOND // 2 - 1).nod == NOD
    assert commands.follow(SECOND // 2).nod == OTHER


def test_the_next_command_is_known_until_it_is_followed():
    commands = NodCommands(ServoConfig())
    assert commands.next(0) is None
    commands.accept(NOD, 0)
    commands.follow(0)
    assert commands.next(0) is None
    commands.accept(OTHER, 1, start_ns=SECOND // 2)
    commands.follow(1)
    assert commands.next(1) == (OTHER, SECOND // 2)
    commands.follow(SECOND // 2)
    assert commands.next(SECOND // 2) is None


def test_the_lead_of_the_servo_counts_for_the_start_too():
    """A servo that is led turns before the commanded turn, at which the next command begins."""
    commands = NodCommands(ServoConfig())
    commands.accept(NOD, 0)
    commands.accept(OTHER, 1, start_ns=SECOND // 2)
    commands.follow(1).phase.lead_ns = 1000
    assert commands.follow(SECOND // 2 - 1001).nod == NOD
    assert commands.follow(SECOND // 2 - 1000).nod == OTHER


@pytest.mark.parametrize('is_followed', [False, True])
def test_a_command_that_has_begun_stays_until_the_next_one_begins(is_followed):
    commands = NodCommands(ServoConfig())
    commands.accept(NOD, 0)
    commands.accept(OTHER, 1, start_ns=100)
    if is_followed:
        commands.follow(100)
    commands.accept(THIRD, 101, start_ns=SECOND // 2)
    assert commands.follow(SECOND // 2 - 1).nod == OTHER
    assert commands.follow(SECOND // 2).nod == THIRD


def test_a_command_that_the_lead_begins_is_not_taken_back_by_one_for_later():
    commands = NodCommands(ServoConfig())
    commands.accept(NOD, 0)
    commands.accept(OTHER, 1, start_ns=SECOND // 4)
    commands.follow(1).phase.lead_ns = 10_000_000
    now_ns = SECOND // 4 - 10_000_000
    assert commands.follow(now_ns).nod == OTHER
    commands.accept(THIRD, now_ns, start_ns=SECOND // 2)
    assert commands.follow(now_ns).nod == OTHER


def test_a_command_at_once_replaces_one_for_later():
    commands = NodCommands(ServoConfig())
    commands.accept(NOD, 0)
    commands.accept(OTHER, 1, start_ns=SECOND // 2)
    commands.accept(NOD, 2)
    assert commands.follow(SECOND // 2).nod == NOD


def test_with_no_command_before_it_one_for_later_counts_at_once():
    commands = NodCommands(ServoConfig(command_timeout=0.5))
    commands.accept(NOD, 0, start_ns=SECOND)
    assert commands.follow(0).nod == NOD
    commands.accept(OTHER, 2 * SECOND, start_ns=3 * SECOND)  # NOD has timed out
    assert commands.follow(2 * SECOND).nod == OTHER


def test_a_command_for_much_later_is_refused():
    commands = NodCommands(ServoConfig())
    with pytest.raises(ParameterError, match="'start_time' must be at most 60 s from now"):
        commands.accept(NOD, SECOND, start_ns=62 * SECOND)
    assert commands.follow(SECOND) is None


def test_refused_commands_are_counted_and_are_no_sign_of_life():
    """Who sends only nonsense commands nothing: the torque goes off as without commands."""
    commands = NodCommands(ServoConfig(command_timeout=0.6))
    commands.accept(NOD, 0)
    for now_ns in range(0, SECOND, SECOND // 10):
        with pytest.raises(ParameterError, match='pitch_max'):
            commands.accept(TOO_FAR, now_ns)
        commands.refuse(FAR, 0)
        assert (commands.follow(now_ns) is None) == (now_ns > 0.6 * SECOND)
    assert commands.refused == 10
    assert commands.refusal == str(FAR)


def test_a_refusal_between_good_commands_is_new_once():
    commands = NodCommands(ServoConfig())
    news = []
    for _ in range(3):
        commands.accept(NOD, 0)
        news.append(commands.refuse(FAR, 0))
    assert news == [True, False, False]
    assert commands.refuse(FAST, 0)


def test_another_value_beyond_a_limit_is_no_news():
    """A nod that is tuned to the lidar has another duration each time, and another limit."""
    commands = NodCommands(ServoConfig())
    assert commands.refuse(ParameterError('sweep_duration', 'at least 0.2 s', 0.11), 0)
    assert not commands.refuse(ParameterError('sweep_duration', 'at least 0.3 s', 0.12), 0)
    assert commands.refusal == "'sweep_duration' must be at least 0.3 s, but is 0.12"


def test_a_fault_that_returns_after_a_while_is_news():
    commands = NodCommands(ServoConfig())
    refused = [0, 1, 5, 9, 15]  # s
    news = [commands.refuse(FAR, at * SECOND) for at in refused]
    assert news == [True, False, False, False, True]


def test_only_refused_commands_give_nothing_to_follow():
    commands = NodCommands(ServoConfig())
    commands.refuse(FAR, 0)
    assert commands.follow(0) is None


def test_a_nod_over_next_to_nothing_is_refused_by_a_joint_of_any_speed():
    commands = NodCommands(TrajectoryConfig())
    with pytest.raises(ParameterError, match="'sweep_duration' must be at most 1e-07 s"):
        commands.accept(Nod(0.0, 1e-9, 0.4, 4001, 0), 0)
    commands.accept(Nod(0.0, 0.01, 0.4, 4001, 0), 0)


def test_a_start_counts_by_its_own_clock_which_may_pass_at_another_rate():
    commands, begun = NodCommands(ServoConfig()), 99 * SECOND
    commands.accept(NOD, 0, clock_ns=begun)
    commands.accept(OTHER, 1, 100 * SECOND, clock_ns=begun)
    assert commands.follow(SECOND // 2, 100 * SECOND - 1).nod == NOD
    commands.accept(OTHER, SECOND // 2, 100 * SECOND, clock_ns=100 * SECOND - 1)
    assert commands.follow(SECOND // 2, 100 * SECOND - 1).nod == NOD
    assert commands.follow(SECOND // 2, 100 * SECOND).nod == OTHER
    with pytest.raises(ParameterError, match='start_time'):
        commands.accept(OTHER, 100 * SECOND, 100 * SECOND, clock_ns=1)

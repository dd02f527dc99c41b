"""Processes in a launch; those that wait for another wait for its file or its end."""

import asyncio
import os
import signal
import subprocess
import sys

from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.event_handlers import OnProcessStart, OnShutdown
import pytest

BUSY = 'while :; do sleep 0.05; done'
LONG = {'sigterm_timeout': '3600'}  # s


class Exits(dict):
    """Exit codes by the name of the process, for on_exit."""

    def __call__(self, event, context):
        self[event.process_name.split('-')[0]] = event.returncode


@pytest.fixture
def exits():
    return Exits()


def shell(script, **kwargs):
    return ExecuteProcess(cmd=['sh', '-c', script], **{'output': 'screen', 'name': 'p', **kwargs})


def configuration(name, value):
    return DeclareLaunchArgument(name, default_value=value, description='')


def sleeper(exits):
    return ExecuteProcess(cmd=['sleep', '60'], output='screen', on_exit=exits)


def send(signal_number):
    """Return a process that ends at once, upon which this process gets a signal."""
    return shell('true', on_exit=lambda event, context: os.kill(os.getpid(), signal_number))


def test_output_and_exit_code(launch, exits):
    code, out = launch(shell('echo out; echo err >&2; printf "no end"; exit 3', on_exit=exits))
    assert code == 0  # a process that fails is no error of the launch
    name = out.split('[INFO] [p')[1].split(']')[0]
    for line in ('out', 'err', 'no end'):
        assert f'[p{name}] {line}\n' in out
    assert f'[ERROR] [p{name}]: process has died [pid ' in out
    assert exits == {'p': 3}


@pytest.fixture
def reap_in_the_loop():
    """Have ended processes wait for the event loop, as they do from Python 3.12 on."""
    if sys.version_info < (3, 12):
        policy = asyncio.get_event_loop_policy()
        policy.set_child_watcher(asyncio.PidfdChildWatcher())
        yield
        policy.set_child_watcher(asyncio.ThreadedChildWatcher())
    else:
        yield


def test_signal_that_comes_too_late_does_not_cost_the_exit_code(
    launch, exits, reap_in_the_loop, tmp_path
):
    def shutdown_after_the_other_ended(event, context):
        (tmp_path / 'go').touch()
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOWAIT)
        return Shutdown()

    other = shell(f'until test -e {tmp_path}/go; do sleep 0.01; done; exit 7', on_exit=exits)
    launch(other, shell('true', on_exit=shutdown_after_the_other_ended))
    assert exits == {'p': 7}


@pytest.mark.parametrize('name', ['launch-prefix', 'emulate_tty'])
def test_uncovered_configuration_is_refused(launch, name):
    code, out = launch(configuration(name, 'x'), shell('true'))
    assert code == 1
    assert f'ExecuteProcess({name}=) is not covered' in out


def test_all_of_a_long_output_arrives(launch):
    _, out = launch(shell('seq 100000'))
    assert [line.split()[-1] for line in out.split('\n') if line.startswith('[p-')] == [
        str(i) for i in range(1, 100001)
    ]


def test_output_of_a_process_left_behind_does_not_hold_up_the_end(launch, tmp_path):
    _, out = launch(shell(f'sleep 60 & echo $! > {tmp_path}/pid; echo out'))
    os.kill(int((tmp_path / 'pid').read_text()), signal.SIGKILL)
    assert '] out\n' in out


def end_all(event, context):
    return Shutdown(reason='it ended')


def test_missing_command_ends_the_launch(launch, exits):
    command = ExecuteProcess(cmd=['/no/such/command'], output='screen')
    code, out = launch(sleeper(exits), command)
    assert code == 1
    assert "No such file or directory: '/no/such/command'" in out
    assert exits == {'sleep': -signal.SIGINT}


def test_required_process_ends_the_launch(launch, exits):
    code, out = launch(sleeper(exits), shell('exit 1', on_exit=end_all))
    assert code == 0
    assert 'was required: shutting down launched system' in out
    assert exits == {'sleep': -signal.SIGINT}


def test_process_can_follow_on_another(launch):
    code, out = launch(shell('true', on_exit=lambda event, context: shell('echo followed')))
    assert code == 0
    assert '] followed\n' in out


def test_nothing_is_started_after_the_shutdown(launch):
    def end_and_start(event, context):
        context.visit(Shutdown())
        return shell('echo second')

    _, out = launch(shell('echo first', on_exit=end_and_start))
    assert '] first\n' in out
    assert 'second' not in out


def test_last_process_is_ended_first(launch, tmp_path):
    waiting = [shell('exec sleep 60', name=name) for name in ('one', 'two')]
    _, out = launch(*waiting, shell('true', on_exit=end_all))
    assert out.index("'SIGINT' to process[two") < out.index("'SIGINT' to process[one")


def test_stubborn_processes_are_killed(launch, tmp_path, exits):
    """One survives SIGINT, one SIGTERM too; a third process ends once both are ready for it."""
    both_ready = f'until test -e {tmp_path}/1 -a -e {tmp_path}/2; do sleep 0.02; done'
    _, out = launch(
        configuration('sigterm_timeout', '0.2'),
        configuration('sigkill_timeout', '0.2'),
        shell(f'trap "" INT; touch {tmp_path}/1; {BUSY}', name='stubborn', on_exit=exits),
        shell(f'trap "" INT TERM; touch {tmp_path}/2; {BUSY}', name='deaf', on_exit=exits),
        shell(both_ready, on_exit=end_all),
    )
    assert exits == {'stubborn': -signal.SIGTERM, 'deaf': -signal.SIGKILL}
    for seconds, last, following in [('0.2', 'INT', 'TERM'), ('0.4', 'TERM', 'KILL')]:
        assert (
            f"failed to terminate '{seconds}' seconds after receiving 'SIG{last}', "
            f"escalating to 'SIG{following}'" in out
        )


def test_a_process_may_have_longer_to_end_than_the_others(launch, tmp_path, exits):
    """It goes on until another one has got SIGTERM."""
    both_ready = f'until test -e {tmp_path}/1 -a -e {tmp_path}/2; do sleep 0.02; done'
    after = f'until test -e {tmp_path}/3; do sleep 0.02; done; exit 0'
    slow, other = f'trap "{after}" INT', f'trap "touch {tmp_path}/3; exit 1" TERM; trap "" INT'
    _, out = launch(
        configuration('sigterm_timeout', '0.2'),
        shell(f'{slow}; touch {tmp_path}/1; {BUSY}', name='slow', on_exit=exits, **LONG),
        shell(f'{other}; touch {tmp_path}/2; {BUSY}', name='other', on_exit=exits),
        shell(both_ready, on_exit=end_all),
    )
    assert exits == {'slow': 0, 'other': 1}
    assert out.count("escalating to 'SIGTERM'") == 1


def test_a_process_may_have_less_time_to_end_than_the_others(launch, tmp_path, exits):
    soon = {'sigterm_timeout': '0.1', 'sigkill_timeout': '0.1'}
    ready = f'until test -e {tmp_path}/1; do sleep 0.02; done'
    launch(
        configuration('sigterm_timeout', '3600'),
        shell(f'trap "" INT TERM; touch {tmp_path}/1; {BUSY}', name='deaf', on_exit=exits, **soon),
        shell(ready, on_exit=end_all),
    )
    assert exits == {'deaf': -signal.SIGKILL}


def test_terminal_has_sent_the_interrupt_already(launch, exits):
    """With a terminal the processes get its Ctrl-C too, so none is sent from here."""
    timeout = configuration('sigterm_timeout', '0.1')
    code, out = launch(timeout, sleeper(exits), send(signal.SIGINT), noninteractive=False)
    assert code == 0
    assert 'user interrupted with ctrl-c (SIGINT)' in out
    assert "sending signal 'SIGINT'" not in out
    assert exits == {'sleep': -signal.SIGTERM}


@pytest.mark.parametrize(('number', 'code'), [(signal.SIGINT, 0), (signal.SIGTERM, 1)])
def test_signals_end_the_launch_and_its_processes(launch, exits, number, code):
    assert launch(sleeper(exits), send(number))[0] == code
    assert exits == {'sleep': -signal.SIGINT}


def test_error_ends_what_was_started(launch, exits):
    def fail(event, context):
        raise ValueError('no good')

    code, out = launch(sleeper(exits), shell('true', on_exit=fail))
    assert code == 1
    assert 'Caught exception in launch (see debug for traceback): no good' in out
    assert exits == {'sleep': -signal.SIGINT}


def test_screen_that_is_gone_does_not_hinder_the_launch(tmp_path):
    """The reader of the output ends at once; the launch goes on to the last process."""
    script = f"""
from launch import LaunchDescription, LaunchService
from launch.actions import ExecuteProcess
last = ExecuteProcess(cmd=['touch', '{tmp_path}/last'], output='screen')
first = ExecuteProcess(cmd=['echo', 'out'], output='screen', on_exit=lambda *_: last)
service = LaunchService()
service.include_launch_description(LaunchDescription([first]))
service.run()
"""
    reader, writer = os.pipe()
    os.close(reader)
    env = {**os.environ, 'ROS_LOG_DIR': str(tmp_path)}
    subprocess.run(['python3', '-c', script], stdout=writer, stderr=subprocess.DEVNULL, env=env)
    os.close(writer)
    assert (tmp_path / 'last').exists()


def handling(*handlers):
    """Register event handlers."""

    def register(context):
        for handler in handlers:
            context.register_event_handler(handler)

    return OpaqueFunction(function=register)


def test_the_start_of_a_process_is_handled_where_it_is_the_target(launch):
    target, other = shell('exec sleep 60', name='target'), shell('exec sleep 60', name='other')
    pids = []

    def react(event, context):
        pids.append(event.pid)
        return Shutdown()

    _, out = launch(handling(OnProcessStart(target_action=target, on_start=react)), other, target)
    assert len(pids) == 1
    name = next(line for line in out.splitlines() if f'with pid [{pids[0]}]' in line)
    assert '[target-' in name


def test_the_shutdown_is_handled_once_and_while_it_is_one(launch, exits):
    seen = []
    handler = OnShutdown(on_shutdown=lambda _, context: seen.append(context.is_shutdown))
    launch(handling(handler), sleeper(exits), shell('true', on_exit=end_all))
    assert seen == [True]

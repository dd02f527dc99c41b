import os
from pathlib import Path
import signal

from launch.actions import (
    EmitEvent,
    ExecuteProcess,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    SetLaunchConfiguration,
    Shutdown,
    TimerAction,
)
from launch.event_handlers import OnProcessExit, OnProcessStart, OnShutdown
from launch.events import matches_action
from launch.events.process import matches_name, ShutdownProcess, SignalProcess
import pytest

BUSY = 'while :; do sleep 0.05; done'


def shell(script, **kwargs):
    return ExecuteProcess(cmd=['sh', '-c', script], **{'output': 'screen', 'name': 'p', **kwargs})


def test_output_and_exit_code(launch):
    exits = []
    process = shell(
        'echo out; echo err >&2; printf "no end"; exit 3',
        on_exit=lambda event, context: exits.append((event.returncode, event.process_name)),
    )
    code, out = launch(process)
    name = process.name
    assert code == 0  # a process that fails is no error of the launch
    for line in ('out', 'err', 'no end'):
        assert f'[{name}] {line}\n' in out
    assert f'[ERROR] [{name}]: process has died [pid ' in out
    assert exits == [(3, name)]
    assert process.return_code == 3


def test_destinations_of_output(launch):
    _, out = launch(shell('echo out; echo err >&2', output='log'))
    log = Path(out.split('found below ')[1].split('\n')[0], 'launch.log').read_text()
    assert '] err' in out
    assert '] out' not in out
    assert '] out' in log
    assert '] err' in log
    code, out = launch(shell('true', output='own_log'))
    assert code == 1
    assert "output='own_log' is not covered" in out


def test_all_of_a_long_output_arrives(launch):
    _, out = launch(shell('seq 100000'))
    assert [line.split()[-1] for line in out.split('\n') if line.startswith('[p-')] == [
        str(i) for i in range(1, 100001)
    ]


def test_terminal_is_emulated_on_demand(launch):
    script = 'test -t 1 && echo terminal || echo pipe'
    assert '] pipe\n' in launch(shell(script))[1]
    assert '] terminal\n' in launch(shell(script, emulate_tty=True))[1]
    assert '] terminal\n' in launch(SetLaunchConfiguration('emulate_tty', '1'), shell(script))[1]


def test_environment_directory_shell_and_prefix(launch, tmp_path, monkeypatch):
    monkeypatch.setenv('INHERITED', 'yes')
    _, out = launch(
        shell('echo a $INHERITED $MORE; pwd', additional_env={'MORE': 'x'}, cwd=str(tmp_path)),
        shell('echo b $INHERITED $PATH-', env={'PATH': '/bin:/usr/bin'}),
        ExecuteProcess(cmd=['echo', 'c', '|', 'tr c d'], shell=True, output='screen'),
        ExecuteProcess(cmd=['d'], prefix='echo "p q"', output='screen'),
    )
    assert '] a yes x\n' in out
    assert f'] {tmp_path}\n' in out
    assert '] b /bin:/usr/bin-\n' in out
    assert '] d\n' in out
    assert '] p q d\n' in out


def test_missing_command_is_logged(launch):
    _, out = launch(ExecuteProcess(cmd=['/no/such/command']))
    assert 'exception occurred while executing process' in out
    assert 'FileNotFoundError' in out


def test_action_is_executed_once(launch):
    process = shell('true')
    code, out = launch(process, process)
    assert code == 1
    assert 'executed more than once' in out


def test_required_process_ends_the_launch(launch):
    sleeper = shell('exec sleep 60', name='sleeper')
    code, out = launch(sleeper, shell('exit 1', on_exit=[Shutdown(reason='it ended')]))
    assert code == 0
    assert 'was required: shutting down launched system' in out
    assert sleeper.return_code == -signal.SIGINT


def test_stubborn_processes_are_killed(launch, tmp_path):
    """One survives SIGINT, one SIGTERM too; a third process ends once both are ready for it."""
    stubborn = shell(f'trap "" INT; touch {tmp_path}/1; {BUSY}')
    deaf = shell(f'trap "" INT TERM; touch {tmp_path}/2; {BUSY}', sigkill_timeout='0.2')
    both_ready = f'until test -e {tmp_path}/1 -a -e {tmp_path}/2; do sleep 0.02; done'
    _, out = launch(
        SetLaunchConfiguration('sigterm_timeout', '0.2'),
        stubborn,
        deaf,
        shell(both_ready, on_exit=Shutdown()),
    )
    assert stubborn.return_code == -signal.SIGTERM
    assert deaf.return_code == -signal.SIGKILL
    assert (
        f"process[{deaf.name}] failed to terminate '0.2' seconds after receiving 'SIGINT', "
        "escalating to 'SIGTERM'" in out
    )


def test_terminal_has_sent_the_interrupt_already(launch):
    """With a terminal the children get its Ctrl-C too, so none is sent from here."""
    process = ExecuteProcess(cmd=['sleep', '60'], sigterm_timeout='0.1')

    def interrupt(event, context):
        os.kill(os.getpid(), signal.SIGINT)

    handler = RegisterEventHandler(OnProcessStart(on_start=interrupt))
    code, out = launch(handler, process, noninteractive=False)
    assert code == 0
    assert 'user interrupted with ctrl-c (SIGINT)' in out
    assert "sending signal 'SIGINT'" not in out
    assert process.return_code == -signal.SIGTERM


@pytest.mark.parametrize(
    ('signal_number', 'code', 'child'), [('SIGINT', 0, 'SIGINT'), ('SIGTERM', 1, 'SIGINT')]
)
def test_signals_end_the_launch_and_its_processes(launch, signal_number, code, child):
    process = ExecuteProcess(cmd=['sleep', '60'])

    def send(event, context):
        os.kill(os.getpid(), signal.Signals[signal_number])

    handler = RegisterEventHandler(OnProcessStart(on_start=send))
    assert launch(handler, process)[0] == code
    assert process.return_code == -signal.Signals[child]


def test_targeted_events(launch):
    stopped, terminated = (ExecuteProcess(cmd=['sleep', '60']) for _ in range(2))
    stop = ShutdownProcess(process_matcher=matches_action(stopped))

    def terminate(event, context):
        matcher = matches_name(event.process_name)
        return [
            EmitEvent(event=SignalProcess(signal_number=signal.SIGTERM, process_matcher=matcher))
        ]

    _, out = launch(
        RegisterEventHandler(
            OnProcessStart(target_action=stopped, on_start=[EmitEvent(event=stop)])
        ),
        RegisterEventHandler(OnProcessStart(target_action=terminated, on_start=terminate)),
        stopped,
        terminated,
    )
    assert stopped.return_code == -signal.SIGINT
    assert terminated.return_code == -signal.SIGTERM
    assert out.count("sending signal 'SIGTERM'") == 1


def test_respawn(launch):
    _, out = launch(shell('echo go', respawn=True, respawn_delay=0.01, respawn_max_retries=2))
    assert out.count('] go\n') == 3


def test_shutdown_ends_the_respawning(launch):
    count = []

    def on_exit(event, context):
        count.append(event.returncode)
        return [Shutdown()] if len(count) == 2 else None

    launch(shell('true', respawn=True, respawn_delay=0.01, on_exit=on_exit))
    assert count == [0, 0]


def test_handlers_see_start_exit_and_shutdown_in_order(launch):
    process = shell('true')
    seen = []

    def note(event, context):
        seen.append((event.name.split('.')[-1], context.locals.event is event))

    def follow(event, context):
        note(event, context)
        return [LogInfo(msg='followed')]

    _, out = launch(
        RegisterEventHandler(OnProcessStart(target_action=process, on_start=note)),
        RegisterEventHandler(OnProcessExit(target_action=process, on_exit=follow)),
        RegisterEventHandler(OnProcessExit(target_action=shell('true'), on_exit=note)),
        RegisterEventHandler(OnShutdown(on_shutdown=note)),
        process,
    )
    assert seen == [('ProcessStarted', True), ('ProcessExited', True), ('Shutdown', True)]
    assert 'followed' in out


def test_timer(launch):
    order = []

    def note(what):
        return OpaqueFunction(function=lambda context: order.append(what))

    launch(
        TimerAction(period=0.05, actions=[note('late')]),
        TimerAction(period=0.01, actions=[note('soon')]),
        note('now'),
    )
    assert order == ['now', 'soon', 'late']


def test_shutdown_cancels_timers(launch):
    code, out = launch(TimerAction(period=60.0, actions=[LogInfo(msg='late')]), Shutdown())
    assert code == 0
    assert 'late' not in out


def test_timer_takes_a_float():
    with pytest.raises(TypeError):
        TimerAction(period=1, actions=[])


def test_error_ends_what_was_started(launch):
    def fail(context):
        raise ValueError('no good')

    process = ExecuteProcess(cmd=['sleep', '60'])
    failing = RegisterEventHandler(
        OnProcessStart(target_action=process, on_start=[OpaqueFunction(function=fail)])
    )
    code, out = launch(failing, process)
    assert code == 1
    assert 'Caught exception in launch (see debug for traceback): no good' in out
    assert process.return_code == -signal.SIGINT

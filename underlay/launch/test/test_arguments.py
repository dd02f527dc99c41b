import asyncio

from launch import LaunchContext, LaunchDescription, LaunchService
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
import pytest


def argument(name, default, choices=None):
    return DeclareLaunchArgument(name, default_value=default, description='which', choices=choices)


def values(*names):
    """Show the values of launch arguments."""

    def echo(context):
        shown = [context.launch_configurations[name] for name in names]
        return [ExecuteProcess(cmd=['echo', 'values:', *shown], output='screen')]

    return OpaqueFunction(function=echo)


def test_default_holds_where_nothing_is_set(launch):
    code, out = launch(
        argument('a', '1'), argument('b', '3'), argument('a', '2'), values('a', 'b')
    )
    assert code == 0
    assert 'values: 1 3' in out


def test_choices_are_described():
    assert argument('a', 'x').description == 'which'
    assert argument('a', 'x', ['x', 'y']).description == "which. Valid choices are: ['x', 'y']"


def test_value_outside_the_choices_is_an_error(launch):
    first = argument('a', 'z')
    assert launch(first, argument('a', 'z', ['z']))[0] == 0
    code, out = launch(first, argument('a', 'x', ['x', 'y']), values('a'))
    assert code == 1
    assert """Argument "a" provided value "z" is not valid. Valid options are: ['x', 'y']""" in out
    assert 'process started' not in out


def test_arguments_are_found_in_a_description():
    arguments = [argument('a', '1'), argument('b', '2')]
    description = LaunchDescription([arguments[0], values('a'), arguments[1]])
    assert description.get_launch_arguments() == arguments


def test_a_function_may_return_nothing_to_visit(launch):
    code, out = launch(OpaqueFunction(function=lambda context: None))
    assert code == 0
    assert 'process started' not in out


def test_the_context_has_the_event_loop_while_the_launch_runs(launch):
    contexts, running = [], []

    def note(context):
        contexts.append(context)
        running.append(context.asyncio_loop is asyncio.get_running_loop())

    launch(OpaqueFunction(function=note))
    assert running == [True]
    assert contexts[0].asyncio_loop is None


def test_what_a_function_raises_ends_the_launch(launch):
    def fail(context):
        raise ValueError('not as it must be')

    process = ExecuteProcess(cmd=['true'], output='screen')
    code, out = launch(OpaqueFunction(function=fail), process)
    assert code == 1
    assert 'Caught exception in launch (see debug for traceback): not as it must be' in out
    assert 'process started' not in out


def test_uncovered_is_refused():
    import launch
    import launch.actions

    with pytest.raises(NotImplementedError, match=r'launch\.EventHandler'):
        _ = launch.EventHandler
    with pytest.raises(NotImplementedError, match='GroupAction'):
        _ = launch.actions.GroupAction
    with pytest.raises(NotImplementedError, match=r'DeclareLaunchArgument\(condition=\)'):
        DeclareLaunchArgument('a', default_value='1', description='which', condition=None)
    with pytest.raises(NotImplementedError, match=r'ExecuteProcess\(respawn=\)'):
        ExecuteProcess(cmd=['true'], respawn=True)
    with pytest.raises(NotImplementedError, match='output='):
        ExecuteProcess(cmd=['true'])
    with pytest.raises(NotImplementedError, match=r'LaunchService\(argv=\)'):
        LaunchService(argv=[])
    with pytest.raises(NotImplementedError, match=r'LaunchContext\(argv=\)'):
        LaunchContext(argv=[])
    for thing, name in (
        (LaunchDescription([]), 'add_action'),
        (LaunchService(), 'emit_event'),
        (LaunchContext(), 'perform_substitution'),
        (argument('a', '1'), 'describe'),
    ):
        with pytest.raises(NotImplementedError, match=f'{type(thing).__name__}.{name}'):
            getattr(thing, name)

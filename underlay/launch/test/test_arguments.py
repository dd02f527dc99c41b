from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration
import pytest


def values(*names):
    return ExecuteProcess(
        cmd=['echo', 'values:', *(LaunchConfiguration(name) for name in names)], output='screen'
    )


def test_default_is_performed_where_nothing_is_given(launch):
    code, out = launch(
        DeclareLaunchArgument('a', default_value='1'),
        DeclareLaunchArgument('b', default_value=['b of ', LaunchConfiguration('a')]),
        DeclareLaunchArgument('a', default_value='2'),
        values('a', 'b'),
    )
    assert code == 0
    assert 'values: 1 b of 1' in out


def test_missing_argument_is_an_error(launch):
    code, out = launch(DeclareLaunchArgument('need'), ExecuteProcess(cmd=['true']))
    assert code == 1
    assert 'Required launch argument "need" was not provided' in out
    assert 'process started' not in out


def test_choices_are_described_and_hold_for_the_default():
    declare = DeclareLaunchArgument('a', choices=['x', 'y'], description='which')
    assert declare.description == "which. Valid choices are: ['x', 'y']"
    assert DeclareLaunchArgument('a', choices=['x']).description == "One of: ['x']"
    with pytest.raises(RuntimeError, match='not in provided choices'):
        DeclareLaunchArgument('a', default_value='z', choices=['x'])
    with pytest.raises(RuntimeError, match='choices arg is empty'):
        DeclareLaunchArgument('a', choices=[])


def test_value_outside_the_choices_is_an_error(launch):
    first = DeclareLaunchArgument('a', default_value='z')
    assert launch(first, DeclareLaunchArgument('a', choices=['z']))[0] == 0
    code, out = launch(first, DeclareLaunchArgument('a', choices=['x', 'y']), values('a'))
    assert code == 1
    assert """Argument "a" provided value "z" is not valid. Valid options are: ['x', 'y']""" in out
    assert 'process started' not in out


def test_arguments_are_found_in_a_description():
    arguments = [DeclareLaunchArgument('a'), DeclareLaunchArgument('b', default_value='c')]
    again = DeclareLaunchArgument('a', default_value='d')
    description = LaunchDescription([arguments[0], values('a'), arguments[1], again])
    assert description.get_launch_arguments() == arguments


def test_a_function_returns_what_to_visit_next(launch):
    def chosen(context):
        return [values('a')] if context.launch_configurations['a'] == '1' else None

    for value, count in (('1', 1), ('2', 0)):
        argument = DeclareLaunchArgument('a', default_value=value)
        code, out = launch(argument, OpaqueFunction(function=chosen))
        assert code == 0
        assert out.count('] values: 1\n') == count


def test_what_a_function_raises_ends_the_launch(launch):
    def fail(context):
        raise ValueError('not as it must be')

    code, out = launch(OpaqueFunction(function=fail), ExecuteProcess(cmd=['true']))
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
        DeclareLaunchArgument('a', condition=None)
    with pytest.raises(NotImplementedError, match=r'ExecuteProcess\(respawn=\)'):
        ExecuteProcess(cmd=['true'], respawn=True)
    with pytest.raises(NotImplementedError, match='output='):
        ExecuteProcess(cmd=['true'], output={'both': 'screen'})
    with pytest.raises(NotImplementedError, match=r'LaunchService\(argv=\)'):
        launch.LaunchService(argv=[])
    with pytest.raises(NotImplementedError, match=r'LaunchService\.run\(shutdown_when_idle=\)'):
        launch.LaunchService().run(shutdown_when_idle=False)
    with pytest.raises(NotImplementedError, match=r'LaunchContext\(argv=\)'):
        launch.LaunchContext(argv=[])
    for thing, name in (
        (LaunchDescription(), 'add_action'),
        (launch.LaunchService(), 'emit_event'),
        (launch.LaunchContext(), 'perform_substitution'),
        (DeclareLaunchArgument('a'), 'describe'),
        (LaunchConfiguration('a'), 'variable_name'),
    ):
        with pytest.raises(NotImplementedError, match=f'{type(thing).__name__}.{name}'):
            getattr(thing, name)

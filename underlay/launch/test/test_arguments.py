from pathlib import Path

from launch import LaunchDescription, LaunchDescriptionSource
from launch.actions import (
    DeclareLaunchArgument,
    GroupAction,
    IncludeLaunchDescription,
    LogInfo,
    OpaqueFunction,
    PushLaunchConfigurations,
    RegisterEventHandler,
    SetEnvironmentVariable,
    SetLaunchConfiguration,
)
from launch.conditions import IfCondition, UnlessCondition
from launch.event_handlers import OnShutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
import pytest

CHILD = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo
from launch.substitutions import LaunchConfiguration

def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument('need', description='needed'),
        DeclareLaunchArgument('opt', default_value='default'),
        LogInfo(msg=['child ', LaunchConfiguration('need'), ' ', LaunchConfiguration('opt')]),
    ])
"""


@pytest.fixture
def child(tmp_path):
    path = tmp_path / 'child.launch.py'
    path.write_text(CHILD)
    return PythonLaunchDescriptionSource(str(path))


def values(*names):
    parts = [[LaunchConfiguration(name, default='none'), ' '] for name in names]
    return LogInfo(msg=['values: ', *(x for part in parts for x in part)])


def test_default_is_performed_where_nothing_is_given(launch):
    declare = DeclareLaunchArgument('b', default_value=['b of ', LaunchConfiguration('a')])
    code, out = launch(SetLaunchConfiguration('a', '1'), declare, values('a', 'b'))
    assert code == 0
    assert 'values: 1 b of 1' in out


def test_missing_argument_is_an_error(launch):
    code, out = launch(DeclareLaunchArgument('need', description='why'), LogInfo(msg='after'))
    assert code == 1
    assert 'Required launch argument "need" (description: "why") was not provided' in out
    assert 'after' not in out


def test_choices():
    declare = DeclareLaunchArgument('a', choices=['x', 'y'], description='which')
    assert declare.description == "which. Valid choices are: ['x', 'y']"
    assert DeclareLaunchArgument('a', choices=['x']).description == "One of: ['x']"
    with pytest.raises(RuntimeError, match='not in provided choices'):
        DeclareLaunchArgument('a', default_value='z', choices=['x'])
    with pytest.raises(RuntimeError, match='empty'):
        DeclareLaunchArgument('a', choices=[])


def test_value_outside_the_choices_is_an_error(launch):
    declare = DeclareLaunchArgument('a', choices=['x', 'y'])
    assert launch(SetLaunchConfiguration('a', 'x'), declare)[0] == 0
    code, out = launch(SetLaunchConfiguration('a', 'z'), declare)
    assert code == 1
    assert """Argument "a" provided value "z" is not valid. Valid options are: ['x', 'y']""" in out


def test_arguments_are_found_through_groups_inclusions_and_handlers(child):
    def argument(name, **kwargs):
        return DeclareLaunchArgument(name, **kwargs)

    description = LaunchDescription(
        [
            argument('plain', default_value='first'),
            argument('plain', default_value='second'),
            argument('on_condition', condition=IfCondition('true')),
            GroupAction([argument('in_group')]),
            GroupAction([argument('in_conditional')], condition=UnlessCondition('true')),
            IncludeLaunchDescription(child),
            RegisterEventHandler(OnShutdown(on_shutdown=[argument('in_handler')])),
            GroupAction([argument('hidden')], forwarding=False),
        ]
    )
    found = {a.name: a._conditionally_included for a in description.get_launch_arguments()}
    assert found == {
        'plain': False,
        'on_condition': True,
        'in_group': False,
        'in_conditional': True,
        'need': False,
        'opt': False,
        'in_handler': True,
    }
    assert description.get_launch_arguments()[0].default_value[0].text == 'first'


def test_inclusion_passes_arguments_and_shares_the_scope(launch, child):
    include = IncludeLaunchDescription(child, launch_arguments={'need': 'given'}.items())
    code, out = launch(include, values('need', 'opt'))
    assert code == 0
    assert 'child given default' in out
    assert 'values: given default' in out


def test_inclusion_checks_for_required_arguments(launch, child):
    code, out = launch(IncludeLaunchDescription(child, launch_arguments=[('opt', 'x')]))
    assert code == 1
    assert (
        "Included launch description missing required argument 'need' "
        "(description: 'needed'), given: [opt]" in out
    )


def test_inner_inclusion_gives_what_is_required(launch, child):
    inner = LaunchDescription([IncludeLaunchDescription(child, launch_arguments=[('need', 'n')])])
    code, out = launch(IncludeLaunchDescription(LaunchDescriptionSource(inner)))
    assert code == 0
    assert 'child n default' in out


def test_broken_launch_file_is_an_error(launch, tmp_path):
    path = Path(tmp_path / 'empty.launch.py')
    path.touch()
    code, out = launch(IncludeLaunchDescription(PythonLaunchDescriptionSource(str(path))))
    assert code == 1
    assert "does not contain the required function 'generate_launch_description()'" in out


def test_scopes(launch, monkeypatch):
    monkeypatch.setenv('SCOPED', 'outer')
    change = [SetLaunchConfiguration('a', '2'), SetEnvironmentVariable('SCOPED', 'inner')]
    show = [values('a', 'kept'), LogInfo(msg=['env: ', EnvironmentVariable('SCOPED')])]
    start = SetLaunchConfiguration('a', '1')

    def shown(group):
        return [line for line in launch(start, group, *show)[1].split('\n') if ': ' in line][2:]

    def text(*lines):
        return [f'[INFO] [launch.user]: {line}' for line in lines]

    assert shown(GroupAction([*change, *show])) == text(
        'values: 2 none ', 'env: inner', 'values: 1 none ', 'env: outer'
    )
    bare = GroupAction(show, forwarding=False, launch_configurations={'kept': 'b'})
    assert shown(bare) == text('values: none b ', 'env: outer', 'values: 1 none ', 'env: outer')
    unscoped = GroupAction(change, scoped=False)
    assert shown(unscoped) == text('values: 2 none ', 'env: inner')


def test_conditions_and_functions(launch):
    def function(context, *args, **kwargs):
        return [LogInfo(msg=f'{context.launch_configurations["a"]} {args} {kwargs}')]

    code, out = launch(
        SetLaunchConfiguration('a', '1'),
        LogInfo(msg='never', condition=IfCondition('false')),
        LogInfo(msg='always', condition=UnlessCondition('false')),
        OpaqueFunction(function=function, args=['x'], kwargs={'y': 2}),
    )
    assert code == 0
    assert 'never' not in out
    assert 'always' in out
    assert "1 ('x',) {'y': 2}" in out


def test_uncovered_is_refused():
    import launch.actions

    with pytest.raises(NotImplementedError, match='AppendEnvironmentVariable'):
        _ = launch.actions.AppendEnvironmentVariable
    with pytest.raises(NotImplementedError, match=r'PushLaunchConfigurations\(colour=\)'):
        PushLaunchConfigurations(colour='red')

import os
from pathlib import Path
from typing import List  # noqa: UP035

from ament_index_python.packages import PackageNotFoundError
from launch import LaunchContext
from launch.actions import GroupAction, LogInfo, OpaqueFunction, SetLaunchConfiguration
from launch.substitutions import LaunchConfiguration, SubstitutionFailure, TextSubstitution
from launch_ros.actions import Node, PushRosNamespace, SetParameter
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue
from launch_ros.substitutions import ExecutableInPackage, FindPackagePrefix, FindPackageShare
import pytest
import yaml

WHO = LaunchConfiguration('who')


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    """Install a package 'sample' that has an executable 'echo'."""
    index = tmp_path / 'share/ament_index/resource_index/packages'
    library = tmp_path / 'lib/sample'
    for directory in (index, library, tmp_path / 'share/sample'):
        directory.mkdir(parents=True)
    (index / 'sample').touch()
    (index / 'empty').touch()
    (library / 'echo').write_text('#!/bin/sh\necho "$@"\n')
    (library / 'echo').chmod(0o755)
    (library / 'data').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}')
    return tmp_path


@pytest.fixture
def context():
    context = LaunchContext()
    context.launch_configurations['who'] = 'you'
    return context


def node(**kwargs):
    return Node(package='sample', executable='echo', output='screen', **kwargs)


def ros_arguments(launch, entity, one):
    """Return the command line of a node, the executable left out."""
    launch(SetLaunchConfiguration('who', 'you'), entity)
    return one.cmd[1:]


@pytest.mark.parametrize(
    ('options', 'expected', 'node_name'),
    [
        ({}, [], '<node_namespace_unspecified>/<node_name_unspecified>'),
        ({'name': 'n'}, ['-r', '__node:=n'], '<node_namespace_unspecified>/n'),
        ({'name': ['n_', WHO]}, ['-r', '__node:=n_you'], '<node_namespace_unspecified>/n_you'),
        ({'name': 'n', 'namespace': 'a/b/'}, ['-r', '__node:=n', '-r', '__ns:=/a/b'], '/a/b/n'),
        ({'name': 'n', 'namespace': ''}, ['-r', '__node:=n', '-r', '__ns:=/'], '/n'),
        ({'namespace': '/a'}, ['-r', '__ns:=/a'], '/a/<node_name_unspecified>'),
    ],
)
def test_names(prefix, launch, options, expected, node_name):
    one = node(**options)
    assert ros_arguments(launch, one, one) == ['--ros-args', *expected]
    assert one.node_name == node_name


def test_arguments_and_remappings(prefix, launch):
    one = node(
        arguments=['-a', WHO],
        ros_arguments=['--log-level', 'debug'],
        remappings=[('scan', ['scan_', WHO]), ('a', 'b')],
    )
    expected = '-a you --ros-args --log-level debug --ros-args -r scan:=scan_you -r a:=b'
    assert ros_arguments(launch, one, one) == expected.split()


def test_scopes_of_namespaces_and_parameters(prefix, launch):
    inner, absolute, outer = node(name='n', namespace='own'), node(namespace='/top'), node()
    scope = [PushRosNamespace('a'), PushRosNamespace(['b_', WHO]), SetParameter('p', 3)]
    code, _ = launch(
        SetLaunchConfiguration('who', 'you'), GroupAction([*scope, inner, absolute]), outer
    )
    assert code == 0
    assert inner.node_name == '/a/b_you/own/n'
    assert inner.cmd[-4:] == ['-r', '__ns:=/a/b_you/own', '-p', 'p:=3']
    assert absolute.cmd[1:] == ['--ros-args', '-r', '__ns:=/top', '-p', 'p:=3']
    assert outer.cmd[1:] == ['--ros-args']


@pytest.mark.parametrize(
    'entity',
    [
        Node(executable='x', name='not valid'),
        Node(executable='x', namespace='not valid'),
        PushRosNamespace('not valid'),
    ],
)
def test_invalid_names_are_errors(launch, entity):
    assert launch(entity)[0] == 1


def test_second_node_of_a_name_is_warned_of(prefix, launch):
    _, out = launch(*(node(name='same', namespace='/') for _ in range(2)))
    assert 'there are now at least 2 nodes with the name /same' in out


def parameters_of(context, one):
    """Return the content of the parameter files on a node's command line."""
    cmd = one._command(context)
    paths = [Path(cmd[i + 1]) for i, word in enumerate(cmd) if word == '--params-file']
    return [yaml.safe_load(path.read_text()) for path in paths]


def test_parameter_dictionary(prefix, context):
    given = {
        'int': 1,
        'float': 2.0,
        'truth': True,
        'text': '1',
        'nested': {'a': {'b': 'c'}, 'd': 1},
        'ints': [1, 2],
        'floats': [1, 2.5],
        'texts': ['a', '2'],
        'joined': ['a', WHO],
        'separate': [[WHO], ['b']],
        'number': TextSubstitution(text='3'),
        'list': TextSubstitution(text='[1, 2]'),
        'empty': TextSubstitution(text=''),
        ('k_', WHO): 1,
        'as_text': ParameterValue(TextSubstitution(text='3'), value_type=str),
        'as_float': ParameterValue(TextSubstitution(text='3'), value_type=float),
        'as_list': ParameterValue(TextSubstitution(text='[3]'), value_type=List[int]),  # noqa: UP006
    }
    expected = {
        'int': 1,
        'float': 2.0,
        'truth': True,
        'text': '1',
        'nested.a.b': 'c',
        'nested.d': 1,
        'ints': [1, 2],
        'floats': [1.0, 2.5],
        'texts': ['a', '2'],
        'joined': 'ayou',
        'separate': ['you', 'b'],
        'number': 3,
        'list': [1, 2],
        'empty': '',
        'k_you': 1,
        'as_text': '3',
        'as_float': 3.0,
        'as_list': [3],
    }
    one = node(name='n', namespace='a', parameters=[given])
    assert parameters_of(context, one) == [{'/a/n': {'ros__parameters': expected}}]
    unnamed = node(parameters=[{'a': 1}])
    assert parameters_of(context, unnamed) == [{'/**': {'ros__parameters': {'a': 1}}}]


@pytest.mark.parametrize(
    'value', [None, [], [1, 'a'], [1, None], TextSubstitution(text='{a: 1}'), object()]
)
def test_value_that_no_parameter_can_have(prefix, context, value):
    with pytest.raises(TypeError):
        parameters_of(context, node(parameters=[{'a': value}]))


def test_parameter_files(prefix, launch, tmp_path):
    path = tmp_path / 'p.yaml'
    path.write_text('/**: {ros__parameters: {who: $(var who), at: $(find-pkg-share sample)}}')
    one = node(parameters=[str(path), path, [str(tmp_path), '/none.yaml'],
                           ParameterFile(path, allow_substs=True)])  # fmt: skip
    _, out = launch(SetLaunchConfiguration('who', 'you'), one)
    assert one.cmd[1:6] == ['--ros-args', *['--params-file', str(path)] * 2]
    assert f'Parameter file path is not a file: {tmp_path}/none.yaml' in out
    substituted = yaml.safe_load(Path(one.cmd[7]).read_text())
    assert substituted == {
        '/**': {'ros__parameters': {'who': 'you', 'at': str(prefix / 'share/sample')}}
    }


def test_temporary_files_go_with_the_node(prefix, context):
    one = node(parameters=[{'a': 1}])
    path = Path(one._command(context)[-1])
    assert path.is_file()
    del one
    assert not path.exists()


def test_substituted_file_has_to_be_yaml(context, tmp_path):
    path = tmp_path / 'p.yaml'
    path.write_text('a: [$(var who)')
    with pytest.raises(SubstitutionFailure, match='not a valid yaml file'):
        ParameterFile(path, allow_substs=True).evaluate(context)


def test_malformed_options_are_refused():
    with pytest.raises(TypeError, match='list'):
        node(parameters={'a': 1})
    with pytest.raises(TypeError, match='tuples'):
        node(remappings=[['a', 'b']])


def test_packages(prefix, context):
    assert FindPackagePrefix('sample').perform(context) == str(prefix)
    assert FindPackageShare(['sam', 'ple']).perform(context) == str(prefix / 'share/sample')
    executable = ExecutableInPackage('echo', 'sample')
    assert executable.perform(context) == str(prefix / 'lib/sample/echo')
    assert FindPackageShare('sample').describe() == "FindPackageShare(pkg='sample')"


@pytest.mark.parametrize(
    ('executable', 'package', 'error'),
    [
        ('none', 'sample', SubstitutionFailure),
        ('data', 'sample', SubstitutionFailure),
        ('echo', 'empty', SubstitutionFailure),
        ('echo', 'missing', PackageNotFoundError),
    ],
)
def test_missing_executables(prefix, context, executable, package, error):
    with pytest.raises(error):
        ExecutableInPackage(executable, package).perform(context)


def test_missing_executable_ends_the_launch(prefix, launch):
    code, out = launch(Node(package='sample', executable='none'), LogInfo(msg='after'))
    assert code == 1
    assert "executable 'none' not found on the libexec directory" in out
    assert 'after' not in out


def test_node_is_run(prefix, launch):
    seen = []
    note = OpaqueFunction(function=lambda context: seen.append(context.locals.event.returncode))
    one = node(name='n', arguments=['hello'], exec_name='label', on_exit=[note])
    _, out = launch(one)
    assert one.name.startswith('label-')
    assert f'[{one.name}] hello --ros-args -r __node:=n\n' in out
    assert seen == [0]


def test_uncovered_is_refused():
    import launch_ros.actions

    with pytest.raises(NotImplementedError, match='ComposableNodeContainer'):
        _ = launch_ros.actions.ComposableNodeContainer
    with pytest.raises(NotImplementedError, match='autostart'):
        launch_ros.actions.LifecycleNode(executable='x', name='n', namespace='', autostart=True)

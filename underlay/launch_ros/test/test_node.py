from pathlib import Path

from ament_index_python.packages import PackageNotFoundError
from launch import LaunchContext
from launch.actions import ExecuteProcess
from launch.substitutions import LaunchConfiguration, SubstitutionFailure, TextSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import ExecutableInPackage
import pytest
import yaml

WHO = LaunchConfiguration('who')


@pytest.fixture
def context():
    context = LaunchContext()
    context.launch_configurations['who'] = 'you'
    return context


def node(**kwargs):
    return Node(package='sample', executable='echo', output='screen', **kwargs)


@pytest.mark.parametrize(
    ('options', 'expected'),
    [
        ({}, []),
        ({'name': ['n_', WHO]}, ['-r', '__node:=n_you']),
        ({'name': 'n', 'namespace': 'a/b/'}, ['-r', '__node:=n', '-r', '__ns:=/a/b']),
        ({'name': 'n', 'namespace': ''}, ['-r', '__node:=n', '-r', '__ns:=/']),
        ({'namespace': '/a'}, ['-r', '__ns:=/a']),
    ],
)
def test_command_line(prefix, context, options, expected):
    cmd = node(arguments=['-a', WHO], **options).command(context)
    assert cmd == [f'{prefix}/lib/sample/echo', '-a', 'you', '--ros-args', *expected]


@pytest.mark.parametrize('options', [{'name': 'not valid'}, {'namespace': 'not valid'}])
def test_invalid_names_are_errors(prefix, launch, options):
    assert launch(node(**options))[0] == 1


def parameters_of(context, one):
    """Return the content of the parameter files on a node's command line."""
    cmd = one.command(context)
    paths = [Path(cmd[i + 1]) for i, word in enumerate(cmd) if word == '--params-file']
    return [yaml.safe_load(path.read_text()) for path in paths]


def test_parameter_dictionary(prefix, context):
    given = {
        'float': 2.0,
        'truth': True,
        'text': '1',
        'ints': [1, 2],
        'floats': [1, 2.5],
        'group': {'truths': (True, False), 'inner': {'text': 'a'}},
        'number': TextSubstitution(text='3'),
        'list': TextSubstitution(text='[1, 2]'),
        'empty': TextSubstitution(text=''),
        'joined': ParameterValue(['a', WHO]),
        'digit': ParameterValue('3'),
        'as_text': ParameterValue(TextSubstitution(text='3'), value_type=str),
    }
    expected = {
        **given,
        'floats': [1.0, 2.5],
        'group.truths': [True, False],
        'group.inner.text': 'a',
        'number': 3,
        'list': [1, 2],
        'empty': '',
        'joined': 'ayou',
        'digit': '3',
        'as_text': '3',
    }
    del expected['group']
    one = node(name='n', namespace='a', parameters=[given])
    assert parameters_of(context, one) == [{'/a/n': {'ros__parameters': expected}}]
    unnamed = node(namespace='a', parameters=[{'a': 1}])
    assert parameters_of(context, unnamed) == [{'/**': {'ros__parameters': {'a': 1}}}]


@pytest.mark.parametrize('value', [object(), None, {1, 2}, [], [1, 'a'], [1, [2]]])
def test_value_that_no_parameter_can_have(value):
    with pytest.raises(TypeError, match='cannot have the value'):
        node(parameters=[{'group': {'a': value}}])


def test_name_that_no_parameter_can_have():
    with pytest.raises(TypeError, match='cannot have the name 5'):
        node(parameters=[{'group': {5: 'a'}}])


@pytest.mark.parametrize('text', ['null', '[]', '[1, a]', '{a: 1}', '2026-01-01', '['])
def test_text_that_no_parameter_can_be(context, text):
    with pytest.raises(ValueError, match='cannot have the value'):
        ParameterValue(TextSubstitution(text=text)).evaluate(context)


def test_uncovered_parameters_are_refused(context):
    for parameters in ({'a': [WHO, 'b']}, {WHO: 1}, {('a', WHO): 1}):
        with pytest.raises(NotImplementedError, match=r'not covered'):
            node(parameters=[parameters])
    for value in (3, ['a', 'b']):
        with pytest.raises(NotImplementedError, match='only text is'):
            ParameterValue(value)


def test_parameter_files(prefix, launch, context, capsys):
    path = prefix / 'p.yaml'
    path.write_text('/**: {ros__parameters: {a: 1}}')
    one = node(parameters=[str(path), path, [str(prefix), '/none.yaml']])
    assert one.command(context)[1:] == ['--ros-args', *(2 * ['--params-file', str(path)])]
    assert f'Parameter file path is not a file: {prefix}/none.yaml' in capsys.readouterr().out


def test_packages(prefix, context):
    name = ExecutableInPackage('echo', ['sam', 'ple'])
    assert name.perform(context) == str(prefix / 'lib/sample/echo')
    with pytest.raises(PackageNotFoundError):
        ExecutableInPackage('echo', 'missing').perform(context)


@pytest.mark.parametrize('executable', ['none', 'data'])
def test_missing_executables(prefix, context, executable):
    with pytest.raises(SubstitutionFailure, match=f"executable '{executable}' not found"):
        ExecutableInPackage(executable, 'sample').perform(context)


def test_missing_executable_ends_the_launch_before_anything_starts(prefix, launch):
    code, out = launch(ExecuteProcess(cmd=['true']), Node(package='sample', executable='none'))
    assert code == 1
    assert "executable 'none' not found on the libexec directory" in out
    assert 'process started' not in out


def test_node_is_run(prefix, launch):
    seen = []
    on_exit = lambda event, context: seen.append(event.returncode)  # noqa: E731
    _, out = launch(node(name='n', arguments=['hello'], on_exit=on_exit))
    assert '[echo-' in out
    assert '] hello --ros-args -r __node:=n\n' in out
    assert seen == [0]


def test_prefix_and_name_of_the_process(prefix, launch):
    _, out = launch(node(prefix="sh -c 'echo by $0 $1; exec $0 $1'", exec_name=['n', 'ode']))
    said = [line.split('] ', 1)[1] for line in out.splitlines() if line.startswith('[node-')]
    assert said == [f'by {prefix}/lib/sample/echo --ros-args', '--ros-args']


def test_uncovered_is_refused_by_launch_ros():
    import launch_ros.actions

    with pytest.raises(NotImplementedError, match='LifecycleNode'):
        _ = launch_ros.actions.LifecycleNode
    with pytest.raises(NotImplementedError, match=r'Node\(remappings=\)'):
        node(remappings=[('a', 'b')])
    with pytest.raises(NotImplementedError, match='without package'):
        Node(executable='echo')
    with pytest.raises(NotImplementedError, match='value_type'):
        ParameterValue('1', value_type=int)
    with pytest.raises(TypeError, match='list'):
        node(parameters={'a': 1})

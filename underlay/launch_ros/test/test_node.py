from pathlib import Path

from ament_index_python.packages import PackageNotFoundError
from launch import LaunchContext
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import ExecutableInPackage
import pytest
import yaml


@pytest.fixture
def context():
    return LaunchContext()


def node(namespace='', **options):
    return Node(
        package='sample', executable='echo', output='screen', namespace=namespace, **options
    )


@pytest.mark.parametrize(
    ('options', 'expected'),
    [
        ({}, ['-r', '__ns:=/']),
        ({'name': 'n', 'namespace': 'a/b/'}, ['-r', '__node:=n', '-r', '__ns:=/a/b']),
        ({'namespace': '/a'}, ['-r', '__ns:=/a']),
    ],
)
def test_command_line(prefix, context, options, expected):
    cmd = node(arguments=['-a', 'you'], **options).command(context)
    assert cmd == [f'{prefix}/lib/sample/echo', '-a', 'you', '--ros-args', *expected]


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
        'floats': [1.0, 2.5],
        'as_text': ParameterValue('3', value_type=str),
    }
    expected = {**given, 'as_text': '3'}
    one = node(name='n', namespace='a', parameters=[given])
    assert parameters_of(context, one) == [{'/a/n': {'ros__parameters': expected}}]
    top = node(name='n', parameters=[{'a': 1}])
    assert parameters_of(context, top) == [{'/n': {'ros__parameters': {'a': 1}}}]
    unnamed = node(namespace='a', parameters=[{'a': 1}])
    assert parameters_of(context, unnamed) == [{'/**': {'ros__parameters': {'a': 1}}}]


def test_parameter_files(prefix, context):
    one = node(parameters=['one.yaml', {'a': 1}, 'two.yaml'])
    words = one.command(context)[4:]
    assert words[::2] == 3 * ['--params-file']
    assert [words[1], words[5]] == ['one.yaml', 'two.yaml']


def test_packages(prefix, context):
    path = str(prefix / 'lib/sample/echo')
    assert ExecutableInPackage('echo', 'sample').perform(context) == path
    with pytest.raises(PackageNotFoundError):
        ExecutableInPackage('echo', 'missing').perform(context)


@pytest.mark.parametrize('executable', ['none', 'data'])
def test_missing_executables(prefix, context, executable):
    with pytest.raises(RuntimeError, match=f"executable '{executable}' not found"):
        ExecutableInPackage(executable, 'sample').perform(context)


def test_missing_executable_ends_the_launch_before_anything_starts(prefix, launch):
    missing = Node(package='sample', executable='none', namespace='', output='screen')
    code, out = launch(node(), missing)
    assert code == 1
    assert "executable 'none' not found on the libexec directory" in out
    assert 'process started' not in out


def test_node_is_run(prefix, launch):
    seen = []
    on_exit = lambda event, context: seen.append(event.returncode)  # noqa: E731
    _, out = launch(node(name='n', arguments=['hello'], on_exit=on_exit))
    assert '[echo-' in out
    assert '] hello --ros-args -r __node:=n -r __ns:=/\n' in out
    assert seen == [0]


def test_prefix_and_name_of_the_process(prefix, launch):
    _, out = launch(node(prefix="sh -c 'echo by $0 $1; exec $0 $1'", exec_name='node'))
    said = [line.split('] ', 1)[1] for line in out.splitlines() if line.startswith('[node-')]
    assert said == [f'by {prefix}/lib/sample/echo --ros-args', '--ros-args']


@pytest.mark.parametrize(('value', 'kind'), [('1', int), ('1', None), (3, str), (['a'], str)])
def test_only_text_is_a_parameter_value(value, kind):
    with pytest.raises(NotImplementedError, match='only text is'):
        ParameterValue(value, value_type=kind)


def test_uncovered_is_refused_by_launch_ros(prefix, context):
    import launch_ros.actions

    with pytest.raises(NotImplementedError, match='LifecycleNode'):
        _ = launch_ros.actions.LifecycleNode
    with pytest.raises(NotImplementedError, match=r'Node\(remappings=\)'):
        node(remappings=[('a', 'b')])
    with pytest.raises(yaml.YAMLError, match='cannot represent'):
        node(parameters=[{'a': ExecutableInPackage('echo', 'sample')}]).command(context)

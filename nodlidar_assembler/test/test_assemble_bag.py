"""The command assemble_bag: its options, its table and its exit status."""

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
import resource

from bags import recording, write_bag
from nodlidar_assembler.bags.bag_options import absolute, configuration
from nodlidar_assembler.commands.entry_points import assemble_bag
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import PROFILES
from nodlidar_common.errors import ParameterError
from plyfile import PlyData
import pytest

YAML = Path(__file__).parents[1] / 'config' / 'assembler.yaml'


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    path = tmp_path_factory.mktemp('recorded') / 'bag'
    write_bag(recording(3.0), path)
    return path


def rows(output):
    """Return the rows of the table that was printed."""
    lines = (line.strip('│').split('│') for line in output.splitlines())
    return {cells[0].strip(): cells[1].strip() for cells in lines if len(cells) == 2}


def run(*arguments):
    return assemble_bag([str(argument) for argument in arguments])


def test_a_bag_becomes_a_file_and_a_table(bag, tmp_path, capsys):
    assert run(bag, tmp_path / 'out.ply') == 0
    points = len(PlyData.read(tmp_path / 'out.ply')['vertex'].data)
    table = rows(capsys.readouterr().out)
    assert table['scans'] == table['clouds'] == '30'
    assert table['points'] == f'{points}'
    assert table['dropped'] == '0'
    assert table['recorded'].startswith('1700000000.0')
    assert float(table['times real time']) > 1.0


def test_parameters_come_from_the_node_s_file_and_options_win(tmp_path):
    assert configuration(YAML, {}) == AssemblerConfig()
    file = tmp_path / 'mine.yaml'
    file.write_text('assembler: {ros__parameters: {estimator: ends, max_joint_gap: 0.2}}')
    assert configuration(file, {}) == AssemblerConfig(estimator='ends', max_joint_gap=0.2)
    expected = AssemblerConfig(estimator='nearest', max_joint_gap=0.2)
    assert configuration(file, {'estimator': 'nearest'}) == expected


def test_a_misspelt_parameter_is_told(tmp_path, capsys):
    file = tmp_path / 'mine.yaml'
    file.write_text('/**: {ros__parameters: {joint_zro: 0.1, cloud_mode: sweep, servo_id: 3}}')
    assert configuration(file, {}) == AssemblerConfig(cloud_mode='sweep')
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"'{file}': there is no parameter 'joint_zro': is 'joint_zero' meant?"


def test_the_profile_gives_what_neither_file_nor_options_do(tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text('/**: {ros__parameters: {profile: fast, cloud_mode: sweep}}')
    fast = replace(PROFILES['fast'], cloud_mode='sweep')
    assert configuration(file, {}) == fast
    assert configuration(file, {'profile': 'balanced'}) == replace(
        PROFILES['balanced'], cloud_mode='sweep'
    )
    assert configuration(file, {'estimator': 'ends'}) == replace(fast, estimator='ends')
    file.write_text('/**: {ros__parameters: {profile: best}}')
    with pytest.raises(ParameterError, match="'profile' must be one of fast, balanced"):
        configuration(file, {})


def test_values_of_a_file_are_checked_as_the_node_does(tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text('/**: {ros__parameters: {deadline: 0.0}}')
    with pytest.raises(ParameterError, match=r"'deadline' must be between 0\.001 and 10\.0 s"):
        configuration(file, {})


def test_options_reach_the_pipeline(bag, tmp_path, capsys):
    options = '--estimator', 'nearest', '--cloud-mode', 'sweep', '--ego-motion', 'beam'
    assert run(bag, tmp_path / 'out.ply', *options) == 0
    assert 0 < int(rows(capsys.readouterr().out)['clouds']) < 10
    assert 'comment frame odom' in (tmp_path / 'out.ply').read_bytes()[:200].decode()


@pytest.mark.parametrize(
    ('arguments', 'status', 'message'),
    [
        (('nowhere', 'out.ply'), 1, "assemble_bag: error: there is no 'nowhere'"),
        (('.', 'out.xyz'), 1, "'out.xyz' must end in one of"),
        (('.', 'out.ply', '--params', 'none.yaml'), 2, "'none.yaml': No such file or directory"),
        (('.', 'out.ply'), 1, "nothing of '.' can be read"),
    ],
)
def test_what_is_wrong_is_told_on_stderr(
    tmp_path, monkeypatch, capsys, arguments, status, message
):
    monkeypatch.chdir(tmp_path)
    assert run(*arguments) == status
    output = capsys.readouterr()
    assert message in output.err
    assert not output.out


def test_topics_may_be_given_without_the_slash(bag, tmp_path, capsys):
    assert absolute('scan') == absolute('/scan') == '/scan'
    assert run(bag, tmp_path / 'out.ply', '--scan', 'front/scan') == 1
    assert 'no topic /front/scan; it has /joint_states' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (['out.ply', '--estimator', 'best'], ['--estimator', "'best'", 'slerp']),
        (['out.ply', '--estim', 'slerp'], ['--estim']),
        ([], ['output']),
    ],
)
def test_a_command_line_that_is_none_is_refused_in_a_line(bag, capsys, arguments, said):
    assert run(bag, *arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith('assemble_bag: error: ')
    assert error.count('\n') == 1
    assert [part for part in said if part not in error] == []


@pytest.mark.parametrize('name', ['out.ply', 'out.mcap'])
def test_a_file_that_finds_no_room_is_a_line_and_leaves_what_was_there(
    bag, tmp_path, capsys, name
):
    output = tmp_path / name
    output.write_text('old')
    with a_limit_of(100_000):
        assert run(bag, output) == 1
    assert capsys.readouterr().err == f"assemble_bag: error: File too large: '{output}'\n"
    assert output.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [output]


@contextmanager
def a_limit_of(size):
    """Let no file grow beyond a size [bytes], as if the disk were full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)

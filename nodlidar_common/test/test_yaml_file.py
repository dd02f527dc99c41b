"""YAML files: what is refused, where that is, and that any text is taken or refused."""

from contextlib import suppress

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.yaml_file import LONGEST, parse_yaml, read_yaml, YamlError
import pytest


def test_what_a_file_has_comes_out(tmp_path):
    path = tmp_path / 'a.yaml'
    path.write_bytes(b'\xef\xbb\xbfrate: 2.5\nplaces: [1, {y: x}]\n')  # with a byte order mark
    assert read_yaml(path) == {'rate': 2.5, 'places': [1, {'y': 'x'}]}


@pytest.mark.parametrize('text', ['1e-3', '1E-3', '+1.e-3', '.1e-2', '-2e3', '5.0e+2', '4E2'])
def test_numbers_with_an_exponent_are_numbers_as_in_ros(text):
    assert parse_yaml(f'a: {text}', 'f.yaml') == {'a': float(text)}


@pytest.mark.parametrize('text', ['1e', 'e5', '1e5m', '"1e5"', '1 e5', '.e5', '2024-1e5'])
def test_what_only_resembles_one_is_a_text(text):
    assert parse_yaml(f'a: {text}', 'f.yaml') == {'a': text.strip('"')}


@pytest.mark.parametrize('text', ['!!python/object:os.system x', '!!timestamp x', '!!int "x"'])
def test_tags_construct_nothing_as_in_ros(text):
    assert parse_yaml(f'a: {text}', 'f.yaml') == {'a': 'x'}


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('a: 1\nb: 2\na: 3\n', r"'f.yaml', line 3: the key 'a' comes twice"),
        ('b:\n  a: 1\n  a: 1\n', r"'f.yaml', line 3: the key 'a' comes twice"),
        ('a: &x [1]\nb: *x\n', r"'f.yaml', line 2: aliases are not allowed"),
        ('a: &x [*x]\n', r"'f.yaml', line 1: aliases are not allowed"),
        ('a: [1, 2\n', r"'f.yaml', line 2: expected ',' or ']'"),
        ('a: 1\n? [b]\n: 2\n', r"'f.yaml', line 2: found unhashable key"),
        ('a: \x00', r"'f.yaml': is not YAML"),
        ('[' * 1500, r"'f.yaml': is nested too deeply"),
        ('#' * (LONGEST + 1), rf"'f.yaml': has more than {LONGEST} bytes"),
    ],
)
def test_what_is_refused_is_named_with_its_line(text, message):
    with pytest.raises(YamlError, match=message):
        parse_yaml(text, 'f.yaml')


@pytest.mark.parametrize(
    ('name', 'message'),
    [
        ('none.yaml', r"none.yaml': No such file"),
        ('.', 'Is a directory'),
        ('/dev/zero', 'has more than'),
        ('a\0b', 'null'),
    ],
)
def test_what_is_no_file_is_refused(tmp_path, name, message):
    with pytest.raises(YamlError, match=message):
        read_yaml(f'{tmp_path}/{name}' if name[0] != '/' else name)


def test_what_is_no_text_is_refused(tmp_path):
    (tmp_path / 'a.yaml').write_bytes(b'a: \xff')
    with pytest.raises(YamlError, match=r"a.yaml': is not UTF-8 text"):
        read_yaml(tmp_path / 'a.yaml')


PIECES = [
    *('a', 'b', ': ', ':', '- ', '\n', '  ', '[', ']', '{', '}', ',', '&a ', '*a', '<<: ', '? '),
    *('!!int ', '!!bool x', '!!binary ', '!!set ', '!!omap ', '!!timestamp ', '2001-99-99'),
    *('0x_', '0b_', '1:99', '1e400', '.nan', '"', "'", '|', '>', '%YAML 9.9\n', '---\n', '\x85'),
]


@given(st.lists(st.sampled_from(PIECES), max_size=30).map(''.join))
def test_any_text_is_taken_or_refused(text):
    with suppress(YamlError):
        parse_yaml(text, 'f.yaml')

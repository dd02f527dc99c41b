from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common import scip
import numpy as np
import pytest


@pytest.mark.parametrize(
    ('value', 'characters', 'text'),
    [(1234, 2, b'CB'), (5432, 3, b'1Dh'), (16_000_000, 4, b'm2@0')],
)
def test_examples_of_the_specification(value, characters, text):
    assert scip.encode([value], characters) == text
    assert scip.decode(text, characters).tolist() == [value]


@pytest.mark.parametrize(('data', 'line'), [(b'00', b'00P'), (b'99', b'99b'), (b'JUGn', b'JUGnD')])
def test_sum_of_recorded_lines(data, line):
    assert scip.add_sum(data) == line
    assert scip.strip_sum(line) == data


@given(
    st.integers(2, 4).flatmap(
        lambda n: st.tuples(st.just(n), st.lists(st.integers(0, 64**n - 1), max_size=800))
    )
)
def test_values_survive_the_wire(case):
    characters, values = case
    lines = scip.split_blocks(scip.encode(np.array(values, dtype=np.int64), characters))
    assert all(len(line) <= 65 for line in lines)
    assert scip.decode(scip.join_blocks(lines), characters).tolist() == values


@given(st.binary(min_size=1, max_size=64), st.integers(0, 63), st.integers(1, 63))
def test_one_changed_character_fails_the_sum(data, position, change):
    line = bytearray(scip.add_sum(data))
    position %= len(data)
    line[position] ^= change
    with pytest.raises(scip.ScipError, match='the sum of'):
        scip.strip_sum(bytes(line))


def test_full_scan_has_32_lines():
    lines = scip.split_blocks(scip.encode(np.zeros(682, dtype=np.int64), 3))
    assert [len(line) for line in lines] == [65] * 31 + [63]


@pytest.mark.parametrize(('values', 'characters'), [([4096], 2), ([-1], 3), ([64**3], 3)])
def test_values_that_do_not_fit_are_refused(values, characters):
    with pytest.raises(scip.ScipError, match=r'must be in 0\.\.'):
        scip.encode(values, characters)


@pytest.mark.parametrize('data', [b'0', b'0\n', b'0p', b'/0', b'0\xff'])
def test_bytes_that_are_no_values_are_refused(data):
    with pytest.raises(scip.ScipError):
        scip.decode(data, 2)


def test_an_empty_line_has_no_sum():
    with pytest.raises(scip.ScipError):
        scip.strip_sum(b'')


@given(
    st.text('ABCDEFGHIJKLMNOPQRSTUVWXYZ', min_size=1),
    st.text(st.characters(min_codepoint=32, max_codepoint=126)),
)
def test_information_lines_survive_the_wire(key, value):
    assert scip.parse_information(scip.information_line(key, value)) == (key, value)


def test_semicolon_is_not_summed():
    assert scip.information_line('PROT', 'SCIP 2.0') == b'PROT:SCIP 2.0;N'


@given(st.binary(max_size=40))
def test_garbage_is_no_information_line_and_never_crashes(line):
    try:
        key, value = scip.parse_information(line)
    except scip.ScipError:
        return
    assert f'{key}:{value};' == line[:-1].decode('ascii', 'replace')

"""Parameter files: sections and values are those that a node gets from ROS."""

import re

from hypothesis import example, given
from hypothesis import strategies as st
from nodlidar_common.parameter_file import read_parameters, sections
import pytest
import rclpy

ROWS = r"""
    08 0 -0 010 0x1F -0X1f 0b11 0o17 1_000 1:30 0x 0xg +5
    -.5 +.5 .5e3 .e3 1. 1.e3 1e3 1E+3 1e 1.5.2 . 5_ 1e3x
    9223372036854775807 -9223372036854775808 9223372036854775808 07777777777777777777777777
    .inf -.Inf +.INF .iNF .nan .NaN -.nan inf -INFINITY nan +Nan
    y Yes TRUE on N no False OFF oN tRUE null ~ << = 2001-01-01 2001-99-99
    '1' "y" "\x31" [1,2] [1.0,.5] [on,Y] ['1',a]
"""
WORDS = [*ROWS.split(), '\u0661', '!!str 1', '!!float 1', '!!int "5"', '! 5', '|-\n     5']
QUIET = {'enable_rosout': False, 'start_parameter_services': False}


@pytest.fixture(scope='module')
def parameters(tmp_path_factory):
    """Return a function that returns the parameters of a node by ROS, and by our reader."""
    folder = tmp_path_factory.mktemp('files')

    def of(node, *texts):
        paths = [folder / f'{k}.yaml' for k in range(len(texts))]
        for path, text in zip(paths, texts, strict=True):
            path.write_text(text)
        words = [word for path in paths for word in ('--params-file', str(path))]
        context = rclpy.Context()
        rclpy.init(args=['--ros-args', *words], context=context)
        namespace, _, name = node.rpartition('/')
        made = rclpy.create_node(name, namespace=namespace, context=context, **QUIET)
        theirs = {key: each.value for key, each in made._parameter_overrides.items()}
        made.destroy_node()
        rclpy.shutdown(context=context)
        found = sections(node, *map(read_parameters, paths))
        return theirs, {key: value for each in found for key, value in each.items()}

    return of


def section(name, values):
    for part in reversed(name):
        values = f'{{"{part}": {values}}}'
    return values[1:-1]


def names(most, parts):
    return st.lists(st.sampled_from(parts), min_size=1, max_size=most).map('/'.join)


PATTERNS = names(3, ['a', 'b', 'aa', '*', '**'])
SECTIONS = st.tuples(
    st.tuples(PATTERNS | PATTERNS.map('/{}'.format)) | st.tuples(PATTERNS, PATTERNS),
    st.dictionaries(st.sampled_from('pqr'), st.integers(0, 99)),
)
FILES = st.lists(SECTIONS, min_size=1, max_size=5, unique_by=lambda each: each[0][0])


# A section stands where its name, as it is written, comes first.
@example('/a', [[(('a',), {'p': 1}), (('/a',), {'p': 2})], [(('a',), {'p': 3})]])
@given(names(3, ['a', 'b', 'aa']).map('/{}'.format), st.lists(FILES, min_size=1, max_size=2))
def test_a_node_has_the_parameters_of_its_sections_as_in_ros(parameters, node, files):
    def line(name, values):
        inner = ', '.join(f'{key}: {value}' for key, value in values.items())
        return section((*name, 'ros__parameters'), f'{{{inner}}}')

    theirs, ours = parameters(node, *('\n'.join(line(*each) for each in file) for file in files))
    assert ours == theirs


def check_values(parameters, texts):
    lines = (f'    x{k}: {text}\n' for k, text in enumerate(texts))
    theirs, ours = parameters('/a', '/**:\n  ros__parameters:\n    first: 0\n' + ''.join(lines))
    # Their written form tells 1 from 1.0 and true, and NaN is NaN.
    assert {key: repr(value) for key, value in ours.items()} == {
        key: repr(value if not isinstance(value, tuple) else [*value])
        for key, value in theirs.items()
    }


def test_words_and_lists_have_the_values_that_ros_gives_them(parameters):
    check_values(parameters, WORDS)


def is_known_to_differ(text):
    """Whether it is no value in YAML, a hexadecimal float, or one beyond the range of floats."""
    return re.fullmatch(r'-|.*:|[-+]?0[xX].*\..*|.*[eE][-+]?[0-9]{3,}', text)


PLAIN = st.text('0123456789xXeE+-._:aAnNyYiIfF', min_size=1, max_size=9)


@given(st.lists(PLAIN.filter(lambda text: not is_known_to_differ(text)), max_size=30))
def test_any_plain_text_has_the_value_that_ros_gives_it(parameters, texts):
    check_values(parameters, texts)

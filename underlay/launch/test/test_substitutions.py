from typing import List  # noqa: UP035

from launch import LaunchContext
from launch.conditions import IfCondition, InvalidConditionExpressionError, UnlessCondition
from launch.frontend import parse_substitution
from launch.substitutions import (
    Command,
    EnvironmentVariable,
    EqualsSubstitution,
    FindExecutable,
    IfElseSubstitution,
    LaunchConfiguration,
    NotEqualsSubstitution,
    PathJoinSubstitution,
    SubstitutionFailure,
    TextSubstitution,
)
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import coerce_to_type, normalize_typed_substitution
import pytest


@pytest.fixture
def context():
    context = LaunchContext()
    context.launch_configurations.update(who='you', yes='True', no='0')
    return context


def perform(context, value):
    return perform_substitutions(context, normalize_to_list_of_substitutions(value))


def test_parts_are_joined(context):
    assert perform(context, ['for ', LaunchConfiguration(['w', TextSubstitution(text='ho')])]) == (
        'for you'
    )
    assert perform(context, PathJoinSubstitution(['/a', LaunchConfiguration('who')])) == '/a/you'


def test_configuration_needs_a_value_or_a_default(context):
    assert perform(context, LaunchConfiguration('none', default=5)) == '5'
    assert perform(context, LaunchConfiguration('none', default=['a', 'b'])) == 'ab'
    with pytest.raises(SubstitutionFailure, match="'none' does not exist"):
        perform(context, LaunchConfiguration('none'))


@pytest.mark.parametrize('value', [5, b'bytes', None])
def test_only_text_and_substitutions_are_text(value):
    with pytest.raises(TypeError):
        normalize_to_list_of_substitutions([value])


def test_environment(context, monkeypatch):
    monkeypatch.setenv('GREETING', 'hello')
    assert perform(context, EnvironmentVariable('GREETING')) == 'hello'
    assert perform(context, EnvironmentVariable('NO_SUCH', default_value='x')) == 'x'
    with pytest.raises(SubstitutionFailure, match='NO_SUCH'):
        perform(context, EnvironmentVariable('NO_SUCH'))
    assert perform(context, FindExecutable(name='sh')).endswith('/sh')
    with pytest.raises(SubstitutionFailure, match='not found on the PATH'):
        perform(context, FindExecutable(name='no-such-executable'))


def test_command_and_its_standard_error(context):
    loud = 'sh -c "echo out; echo err >&2"'
    assert perform(context, Command('echo a  "b  c"')) == 'a b  c\n'
    assert perform(context, Command(loud, on_stderr='ignore')) == 'out\n'
    assert perform(context, Command(loud, on_stderr='capture')) == 'out\nerr\n'
    with pytest.raises(SubstitutionFailure, match='err'):
        perform(context, Command(loud))
    with pytest.raises(SubstitutionFailure, match='failed'):
        perform(context, Command('false'))
    with pytest.raises(SubstitutionFailure, match='file not found'):
        perform(context, Command('/no/such/command'))


@pytest.mark.parametrize(
    ('left', 'right', 'equal'),
    [
        ('a', 'a', True),
        ('a', 'A', False),
        (True, '1', True),
        ('False', 0, True),
        ('1.0', 1, True),
        ('0.1', 0.2, False),
        (None, '', True),
    ],
)
def test_equality_of_texts_truths_and_numbers(context, left, right, equal):
    assert perform(context, EqualsSubstitution(left, right)) == str(equal).lower()
    assert perform(context, NotEqualsSubstitution(left, right)) == str(not equal).lower()


def test_choice(context):
    assert perform(context, IfElseSubstitution(LaunchConfiguration('yes'), 'a', 'b')) == 'a'
    assert perform(context, IfElseSubstitution(LaunchConfiguration('no'), 'a', 'b')) == 'b'
    with pytest.raises(SubstitutionFailure):
        perform(context, IfElseSubstitution(LaunchConfiguration('who'), 'a', 'b'))
    with pytest.raises(RuntimeError, match='must be specified'):
        IfElseSubstitution('true')


@pytest.mark.parametrize(('text', 'truth'), [('true', 1), (' TRUE', 1), ('1', 1), ('0 ', 0)])
def test_conditions(context, text, truth):
    assert IfCondition(text).evaluate(context) == bool(truth)
    assert UnlessCondition(text).evaluate(context) != bool(truth)


@pytest.mark.parametrize('text', ['', 'yes', '2'])
def test_condition_is_true_or_false(context, text):
    with pytest.raises(InvalidConditionExpressionError):
        IfCondition(text).evaluate(context)


@pytest.mark.parametrize(
    ('text', 'performed'),
    [
        ('', ''),
        ('plain "quoted" $ text', 'plain "quoted" $ text'),
        ('a $(var who) b', 'a you b'),
        ('$(var who)$(var no)', 'you0'),
        ("$(var none 'a b)')", 'a b)'),
        ('$(var $(var none who))', 'you'),
        ('$(equals "$(var who)" you)', 'true'),
        (r'\$(var who)', '$(var who)'),
        (r'$(var none "a\"b")', 'a"b'),
        ("key: value\nother: $(var who) # it's", "key: value\nother: you # it's"),
    ],
)
def test_substitutions_in_text(context, text, performed):
    assert perform_substitutions(context, parse_substitution(text)) == performed


@pytest.mark.parametrize(
    'text', ['$(', '$(var', '$(var who', '$()', '$(var "who)', '$(env a b c)']
)
def test_malformed_substitutions_in_text(text):
    with pytest.raises(ValueError, match=r'malformed|at most'):
        parse_substitution(text)


def test_uncovered_is_refused():
    import launch.substitutions

    with pytest.raises(NotImplementedError, match='eval'):
        parse_substitution('$(eval 1+1)')
    with pytest.raises(NotImplementedError, match='PythonExpression'):
        _ = launch.substitutions.PythonExpression


@pytest.mark.parametrize(
    ('text', 'data_type', 'value'),
    [
        ('1', None, 1),
        ('1.5', None, 1.5),
        ('on', None, True),
        ('[a, b]', None, ['a', 'b']),
        ('1', str, '1'),
        ('1', float, 1.0),
        ('1', bool, True),
        ('[1, 2]', List[int], [1, 2]),  # noqa: UP006
    ],
)
def test_text_as_value(text, data_type, value):
    result = coerce_to_type(text, data_type)
    assert result == value
    assert type(result) is type(value)


@pytest.mark.parametrize(
    ('text', 'data_type'),
    [('a', int), ('2', bool), ('[1, a]', None), ('{a: 1}', None), ('[1]', List[str])],  # noqa: UP006
)
def test_text_is_no_such_value(text, data_type):
    with pytest.raises(ValueError, match=r'convert|literal'):
        coerce_to_type(text, data_type)


def test_value_of_another_type():
    with pytest.raises(TypeError):
        normalize_typed_substitution(1, float)
    assert normalize_typed_substitution([1, 2.5], List[float]) == [1.0, 2.5]  # noqa: UP006

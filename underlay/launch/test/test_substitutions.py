from launch import LaunchContext
from launch.conditions import IfCondition, InvalidConditionExpressionError
from launch.substitution import describe, normalize
from launch.substitution import perform as perform_all
from launch.substitutions import (
    Command,
    EqualsSubstitution,
    IfElseSubstitution,
    LaunchConfiguration,
    PathJoinSubstitution,
    PythonExpression,
    SubstitutionFailure,
    TextSubstitution,
)
import pytest

WHO = LaunchConfiguration('who')


@pytest.fixture
def context():
    context = LaunchContext()
    context.launch_configurations.update(who='you', yes='True', no='0')
    return context


def perform(context, value):
    return perform_all(context, normalize(value))


def test_parts_are_joined(context):
    name = ['w', TextSubstitution(text='ho')]
    assert perform(context, ['for ', LaunchConfiguration(name)]) == 'for you'
    assert perform(context, PathJoinSubstitution(['/a', '', WHO])) == '/a/you'


def test_descriptions():
    path = PathJoinSubstitution(['/a', WHO])
    assert describe(normalize([path, 'b'])) == "PathJoin(''/a' + LaunchConfig('who')') + 'b'"
    assert PythonExpression([WHO, '+1']).describe() == (
        "PythonExpr(LaunchConfig('who') + '+1', ['math'])"
    )
    assert Command(['run ', WHO]).describe() == "Command('run ' + LaunchConfig('who'))"


def test_configuration_needs_a_value(context):
    with pytest.raises(SubstitutionFailure, match="'none' does not exist"):
        perform(context, LaunchConfiguration('none'))


@pytest.mark.parametrize('value', [5, b'bytes', None])
def test_only_text_and_substitutions_are_text(value):
    with pytest.raises(TypeError):
        normalize([value])


def test_command_must_not_fail_or_complain(context):
    assert perform(context, Command('echo a  "b  c"')) == 'a b  c\n'
    with pytest.raises(SubstitutionFailure, match='stderr output: err'):
        perform(context, Command('sh -c "echo out; echo err >&2"'))
    with pytest.raises(SubstitutionFailure, match='failed'):
        perform(context, Command('false'))
    with pytest.raises(SubstitutionFailure, match='file not found'):
        perform(context, Command('/no/such/command'))


@pytest.mark.parametrize(
    ('left', 'right', 'equal'),
    [
        ('a', 'a', 'true'),
        ('a', 'A', 'false'),
        ('True', '1', 'true'),
        ('1.0', '1', 'true'),
        ('0.1', '0.2', 'false'),
        (WHO, 'you', 'true'),
        (['y', TextSubstitution(text='ou')], WHO, 'true'),
        (None, '', 'true'),
        (True, 'True', 'true'),
        (False, 1, 'false'),
        (10, 10 + 1e-10, 'true'),
        (['a', 'b'], 'ab', 'false'),
    ],
)
def test_equality_of_texts_truths_and_numbers(context, left, right, equal):
    assert perform(context, EqualsSubstitution(left, right)) == equal


def test_choice(context):
    assert perform(context, IfElseSubstitution(LaunchConfiguration('yes'), 'a', WHO)) == 'a'
    assert perform(context, IfElseSubstitution(LaunchConfiguration('no'), 'a', WHO)) == 'you'
    with pytest.raises(RuntimeError, match='must be specified'):
        IfElseSubstitution('true')


@pytest.mark.parametrize(('text', 'choice'), [('on', 'a'), ('No', ''), ('0', ''), ('TRUE', 'a')])
def test_choice_is_by_the_truths_of_yaml(context, text, choice):
    assert perform(context, IfElseSubstitution(text, 'a')) == choice


@pytest.mark.parametrize('text', ['', 'you', '2', 'tRuE', '{'])
def test_choice_is_by_nothing_else(context, text):
    with pytest.raises(SubstitutionFailure, match=f"'{text}' is none of"):
        perform(context, IfElseSubstitution(text, 'a', 'b'))


def test_expressions_know_what_is_put_into_them_and_math(context):
    assert perform(context, PythonExpression(["'", WHO, "'.upper() * 2"])) == 'YOUYOU'
    assert perform(context, PythonExpression('[floor(1.5), math.floor(2.5)]')) == '[1, 2]'
    with pytest.raises(NameError):
        perform(context, PythonExpression(WHO))


@pytest.mark.parametrize(('text', 'truth'), [('true', 1), (' TRUE', 1), ('1', 1), ('0 ', 0)])
def test_conditions_are_texts(context, text, truth):
    assert IfCondition(text).evaluate(context) == bool(truth)


@pytest.mark.parametrize('text', ['', 'yes', '2'])
def test_condition_is_true_or_false(context, text):
    with pytest.raises(InvalidConditionExpressionError):
        IfCondition(text).evaluate(context)


def test_uncovered_substitutions_are_refused():
    import launch.substitutions

    with pytest.raises(NotImplementedError, match='FindExecutable'):
        _ = launch.substitutions.FindExecutable
    with pytest.raises(NotImplementedError, match=r'PythonExpression\(python_modules=\)'):
        PythonExpression('1', ['os'])
    with pytest.raises(NotImplementedError, match=r'LaunchConfiguration\(default=\)'):
        LaunchConfiguration('a', default='b')
    with pytest.raises(NotImplementedError, match=r'IfCondition\.describe'):
        IfCondition('1').describe()

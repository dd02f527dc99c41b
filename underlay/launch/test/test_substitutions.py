from launch import LaunchContext
from launch.substitution import describe, normalize
from launch.substitution import perform as perform_all
from launch.substitutions import LaunchConfiguration, SubstitutionFailure, TextSubstitution
import pytest

WHO = LaunchConfiguration('who')


@pytest.fixture
def context():
    context = LaunchContext()
    context.launch_configurations['who'] = 'you'
    return context


def perform(context, value):
    return perform_all(context, normalize(value))


def test_parts_are_joined(context):
    name = ['w', TextSubstitution(text='ho')]
    assert perform(context, ['for ', LaunchConfiguration(name)]) == 'for you'


def test_descriptions():
    assert describe(normalize(['/a', WHO])) == "'/a' + LaunchConfig('who')"


def test_configuration_needs_a_value(context):
    with pytest.raises(SubstitutionFailure, match="'none' does not exist"):
        perform(context, LaunchConfiguration('none'))


@pytest.mark.parametrize('value', [5, b'bytes', None])
def test_only_text_and_substitutions_are_text(value):
    with pytest.raises(TypeError):
        normalize([value])


def test_uncovered_substitutions_are_refused():
    import launch.substitutions

    with pytest.raises(NotImplementedError, match='FindExecutable'):
        _ = launch.substitutions.FindExecutable
    with pytest.raises(NotImplementedError, match=r'LaunchConfiguration\(default=\)'):
        LaunchConfiguration('a', default='b')

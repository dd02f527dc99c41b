"""What becomes of errors that nobody foresaw."""

from nodlidar_common.survival import Survival
import pytest


def fail(value):
    return 1 / value


def test_an_error_is_told_once_with_its_traceback_and_counted():
    told = []
    survival = Survival(told.append)
    guarded = survival.guarded(fail)
    for value in (0, 1, 0, 0):
        guarded(value)
    assert survival.errors == {'ZeroDivisionError in fail': 3}
    [text] = told
    assert 'return 1 / value' in text


def test_each_kind_is_told():
    told = []
    survival = Survival(told.append)
    survival.guarded(fail)(0)
    survival.guarded(fail)('text')
    assert len(told) == 2
    assert set(survival.errors) == {'ZeroDivisionError in fail', 'TypeError in fail'}


def test_what_is_to_end_the_program_ends_it():
    with pytest.raises(KeyboardInterrupt), Survival(print).surviving():
        raise KeyboardInterrupt

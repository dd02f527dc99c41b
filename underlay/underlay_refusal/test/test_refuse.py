import copy
import importlib
import inspect
import sys
import types

import pytest
from underlay_refusal import Partial, refuse, refuse_arguments


@pytest.fixture
def module(monkeypatch):
    module = types.ModuleType('half_done')
    module.Here = 1
    module.__getattr__ = refuse('half_done', ['Here', 'Also'])
    monkeypatch.setitem(sys.modules, 'half_done', module)
    return module


def test_covered_names_are_untouched(module):
    assert module.Here == 1


def test_missing_name_is_refused_with_what_there_is(module):
    with pytest.raises(NotImplementedError, match=r'half_done\.Missing .*: Also, Here\.'):
        _ = module.Missing


def test_from_import_is_refused(module):
    with pytest.raises(NotImplementedError, match=r'half_done\.Missing'):
        exec('from half_done import Missing')


def test_import_machinery_and_inspect_work(module):
    assert importlib.import_module('half_done') is module
    assert inspect.getmodule(module) is module
    assert inspect.unwrap(module) is module
    with pytest.raises(AttributeError, match='__wrapped__'):
        _ = module.__wrapped__


def test_arguments_left_over_are_refused_by_name():
    refuse_arguments('Node', {})
    with pytest.raises(NotImplementedError, match=r'^Node\(a=, b=\) is not covered'):
        refuse_arguments('Node', {'b': 1, 'a': 2})


class Half(Partial):
    def __init__(self):
        self.here = 1

    def also(self):
        pass


def test_missing_attribute_is_refused_with_what_there_is():
    with pytest.raises(NotImplementedError, match=r'^Half\.missing .*: also, here\.'):
        _ = Half().missing


def test_partial_objects_can_be_copied():
    assert copy.deepcopy(Half()).here == 1

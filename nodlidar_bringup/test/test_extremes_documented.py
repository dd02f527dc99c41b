"""The page on extremes names tests that exist, each in its file, and all that are made for it."""

from pathlib import Path
import re

import pytest

WORKSPACE = Path(__file__).parents[2]
PAGE = (WORKSPACE / 'docs' / 'extremes.md').read_text()
FILES = {path.name: path for path in WORKSPACE.glob('nodlidar_*/test/test_*.py')}
ROWS = [line for line in PAGE.splitlines() if line.startswith('| ') and '**' not in line][2:]


def named(text):
    """Return the tests that a text names: `file.py`: `test_one`, `test_two`."""
    file, found = None, set()
    for name in re.findall(r'`(test_\w+(?:\.py)?)`', text):
        if name.endswith('.py'):
            file = name
        else:
            found.add((file, name))
    return found


def defined(file):
    return {(file, name) for name in re.findall(r'^def (test_\w+)', FILES[file].read_text(), re.M)}


@pytest.mark.parametrize('row', ROWS, ids=lambda row: row.split('|')[1].strip())
def test_every_extreme_is_shown_by_tests_that_exist(row):
    shown_by = named(row.split('|')[3])
    assert shown_by
    for file, name in shown_by:
        assert (file, name) in defined(file)


def test_every_test_of_extremes_is_on_the_page():
    made_for_it = {file for file in FILES if file.startswith('test_extremes_')}
    made_for_it.remove(Path(__file__).name)
    assert set().union(*map(defined, made_for_it)) <= named(PAGE)

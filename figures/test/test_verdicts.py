"""Every test that the pages name as a proof exists."""

from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[2]
NAMED = re.compile(r'`(test_\w+)`')
VERDICT = re.compile(r'^\| (?P<claim>.+) \| (?P<verdict>.+) \| (?P<tests>`test_.+`) \|$', re.M)


@pytest.fixture(scope='module')
def tests():
    files = [*ROOT.glob('*/test/*.py')]
    return set(re.findall(r'^def (test_\w+)', '\n'.join(f.read_text() for f in files), re.M))


@pytest.mark.parametrize('page', ['publication', 'model', 'extremes'])
def test_every_named_test_exists(page, tests):
    named = set(NAMED.findall((ROOT / 'docs' / f'{page}.md').read_text()))
    assert len(named) > 10
    assert named - tests == set()


@pytest.mark.parametrize(
    'claim', ['Eq. (2)', 'Eq. (6)', 'Eq. (16)', 'Eq. (23)', 'Theorem 1, first part',
              'Theorem 1, second part', 'Fig. 4', 'Fig. 6a', 'Completion', 'Fig. 6b', 'Fig. 6c',
              'Fig. 8', 'Fig. 10a', 'Fig. 10b', 'Table I', 'Fig. 11'],
)  # fmt: skip
def test_every_claim_has_a_verdict_that_tests_confirm(claim):
    page = (ROOT / 'docs' / 'publication.md').read_text()
    rows = [row for row in VERDICT.finditer(page) if row['claim'].startswith(claim)]
    assert len(rows) == 1

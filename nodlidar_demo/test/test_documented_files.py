"""What the pages name exists: files, names of the code, pages and their sections."""

from pathlib import Path
import re

import pytest

WORKSPACE = Path(__file__).parents[2]
PAGES = [
    *(WORKSPACE / name for name in ('README.md', 'CONTRIBUTING.md')),
    *sorted(WORKSPACE.glob('docs/*.md')),
    *sorted(WORKSPACE.glob('*/README.md')),
]
FILES = [
    f'/{path.relative_to(WORKSPACE)}'
    for folder in ('nodlidar_*', 'bench', 'figures', 'tools', 'underlay', 'docs')
    for path in WORKSPACE.glob(f'{folder}/**/*.*')
]
FILE = re.compile(r'`([\w./]+\.(?:py|yaml|xacro|xml|msg|rviz|md))`')
OF_THE_USER = {'lidar.yaml', 'map.yaml', 'metadata.yaml'}
LINK = re.compile(r'\]\(([^):#\s]*)(?:#([^)\s]+))?\)')


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(WORKSPACE)))
def test_files_of_a_page_exist(page):
    names = set(FILE.findall(page.read_text())) - OF_THE_USER
    assert [n for n in names if not any(file.endswith(f'/{n}') for file in FILES)] == []


def anchors(page):
    """Return the names of a page's sections in links."""
    heads = re.findall(r'^#+ (.+)$', page.read_text(), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', head.lower()).replace(' ', '-') for head in heads}


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(WORKSPACE)))
def test_links_lead_to_pages_and_sections(page):
    links = LINK.findall(page.read_text())
    targets = [((page.parent / path) if path else page, anchor) for path, anchor in links]
    assert [path for path, _ in targets if not path.exists()] == []
    assert [each for each in targets if each[1] and each[1] not in anchors(each[0])] == []


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(WORKSPACE)))
def test_rows_of_a_table_have_as_many_cells_as_its_head(page):
    for table in re.findall(r'(?:^\|.*\n)+', page.read_text(), re.MULTILINE):
        bare = re.sub(r'`[^`]*`|\\\|', '', table)
        assert len({row.count('|') for row in bare.splitlines()}) == 1, table.splitlines()[0]


def test_the_page_on_the_code_names_what_is_in_the_file():
    text = (WORKSPACE / 'docs' / 'code.md').read_text()
    rows = re.findall(r'^\|.*?\| .*?`(nodlidar_[\w/]+\.py)`.*?\| (.*?) \|$', text, re.MULTILINE)
    assert len(rows) > 40
    for path, symbols in rows:
        folder = (WORKSPACE / path).parent
        code = '\n'.join(file.read_text() for file in folder.glob('*.py'))
        for symbol in re.findall(r'`([\w.]+)`', symbols):
            name = symbol.rsplit('.', 1)[-1]
            assert re.search(rf'^ *(class|def) {name}\b|^{name}\b', code, re.MULTILINE), symbol
        assert (WORKSPACE / path).exists()

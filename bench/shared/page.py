"""Pages with tables of recorded measurements, each between two marks."""

import re

from bench.shared.report import markdown, recorded, RESULTS

_WORKSPACE = RESULTS.parent.parent
_MARK = '<!-- bench: '
PAGES = tuple(
    page
    for folder in ('', 'docs/', 'nodlidar_*/')
    for page in sorted(_WORKSPACE.glob(f'{folder}*.md'))
    if _MARK in page.read_text()
)
_MARKED = re.compile(
    r'(<!-- bench: (\w+)(?: where (.*?) = (.*?))?(?:: (.*?))? -->\n).*?(<!-- end -->)', re.DOTALL
)


def filled(text: str) -> str:
    """Return a page with the recorded rows, and where they come from, between its marks.

    The marks are the lines ``<!-- bench: NAME -->`` and ``<!-- end -->``. With ``NAME: one; two``
    the table has only these columns, and only the rows that have all of them. With ``NAME where
    COLUMN = this | that``, which comes before the colon, it has only these rows.

    Raises
    ------
    KeyError
        If no row has the columns.
    """
    return _MARKED.sub(_table, text)


def _table(mark: re.Match[str]) -> str:
    begin, name, by, values, columns, end = mark.groups()
    report = recorded(name)
    rows = report['rows']
    if by is not None:
        rows = [row for row in rows if str(row[by]) in values.split(' | ')]
    if columns is not None:
        names = columns.split('; ')
        rows = [{name: row[name] for name in names} for row in rows if row.keys() >= set(names)]
        if not rows:
            raise KeyError(columns)
    source = f'*`python -m bench {name}`, commit {report["commit"]}, {report["date"]}*'
    return f'{begin}{markdown(rows)}\n\n{source}\n{end}'


def fill_pages() -> None:
    """Write the recorded rows into all pages."""
    for page in PAGES:
        page.write_text(filled(page.read_text()))

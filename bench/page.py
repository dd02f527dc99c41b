"""Pages whose tables are what was recorded of a measurement, each between two marks."""

import re

from bench.report import markdown, recorded, RESULTS

PAGES = tuple(RESULTS.parent.parent / page for page in ('README.md', 'docs/tradeoffs.md'))
_MARKED = re.compile(r'(<!-- bench: (\w+)(?:: (.*?))? -->\n).*?(<!-- end -->)', re.DOTALL)


def filled(text: str) -> str:
    """Return a page with the recorded rows between its marks.

    The marks are the lines ``<!-- bench: NAME -->`` and ``<!-- end -->``; ``<!-- bench: NAME: one;
    other -->`` takes these columns alone.
    """
    return _MARKED.sub(_table, text)


def _table(mark: re.Match[str]) -> str:
    begin, name, columns, end = mark.groups()
    rows = recorded(name)['rows']
    if columns is not None:
        rows = [{column: row[column] for column in columns.split('; ')} for row in rows]
    return f'{begin}{markdown(rows)}\n{end}'


def fill_pages() -> None:
    """Write the recorded rows into all pages."""
    for page in PAGES:
        page.write_text(filled(page.read_text()))

"""Pages whose tables are what was recorded of a measurement, each between two marks."""

import re

from bench.report import markdown, recorded, RESULTS

PAGES = tuple(RESULTS.parent.parent / page for page in ('docs/tradeoffs.md',))
_MARKED = re.compile(r'(<!-- bench: (\w+) -->\n).*?(<!-- end -->)', re.DOTALL)


def filled(text: str) -> str:
    """Return a page with the recorded rows between its marks.

    The marks are the lines ``<!-- bench: NAME -->`` and ``<!-- end -->``.
    """
    return _MARKED.sub(
        lambda mark: f'{mark[1]}{markdown(recorded(mark[2])["rows"])}\n{mark[3]}', text
    )


def fill_pages() -> None:
    """Write the recorded rows into all pages."""
    for page in PAGES:
        page.write_text(filled(page.read_text()))

"""What the page tells of a live sensor in words: coverage, states and rates."""

import numpy as np
from numpy.typing import NDArray
from viser import GuiApi

NO_COVERAGE = 'not heard'
NO_PICTURE = np.zeros((8, 24, 3), dtype=np.uint8)


class StatePanel:
    """Texts in Markdown, and a picture of the directions seen.

    Parameters
    ----------
    gui
        Of the page.
    """

    def __init__(self, gui: GuiApi) -> None:
        self._notice = gui.add_markdown('', order=0.5)
        with gui.add_folder('Coverage'):
            self._coverage = gui.add_markdown(NO_COVERAGE)
            self._picture = gui.add_image(
                NO_PICTURE,
                label='Directions seen, ahead in the middle; red: not seen',
                format='png',
            )
        with gui.add_folder('State'):
            self._diagnostics = gui.add_markdown('')
        with gui.add_folder('Rates', expand_by_default=False):
            self._rates = gui.add_markdown('')

    def show_texts(self, notice: str, diagnostics: str, rates: str) -> None:
        """Show what is missing, statuses and rates."""
        for handle, text in (
            (self._notice, notice),
            (self._diagnostics, diagnostics),
            (self._rates, rates),
        ):
            if handle.content != text:
                handle.content = text

    def show_coverage(self, text: str, picture: NDArray[np.uint8]) -> None:
        """Show observed coverage, and the directions seen, shape (rows, columns, 3)."""
        self._coverage.content = text
        self._picture.image = picture

    def forget_coverage(self) -> None:
        """Show that coverage is not heard."""
        if self._coverage.content != NO_COVERAGE:
            self.show_coverage(NO_COVERAGE, NO_PICTURE)

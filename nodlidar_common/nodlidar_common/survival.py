"""What lets a node go on after an error that nobody foresaw: told with its cause, and counted."""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import traceback
from typing import Any


class Survival:
    """A shell around what may fail in a node.

    Parameters
    ----------
    tell
        Told of the first error of each kind, with its traceback.

    Attributes
    ----------
    errors
        How many there were, by the error's type and the function that raised it.
    """

    def __init__(self, tell: Callable[[str], Any]) -> None:
        self.errors: Counter[str] = Counter()
        self._tell = tell

    @contextmanager
    def surviving(self) -> Iterator[None]:
        """Go on after whatever is raised within."""
        try:
            yield
        except Exception as error:
            self.note(error)

    def guarded(self, callback: Callable[..., Any]) -> Callable[..., None]:
        """Return a callback after whose errors its caller goes on."""

        def survive(*given: Any) -> None:
            with self.surviving():
                callback(*given)

        return survive

    def note(self, error: Exception) -> None:
        """Count an error; tell of it if it is the first of its kind."""
        where = traceback.extract_tb(error.__traceback__)[-1].name
        kind = f'{type(error).__name__} in {where}'
        self.errors[kind] += 1
        if self.errors[kind] == 1:
            cause = ''.join(traceback.format_exception(error))
            self._tell(f'internal error; the node goes on and counts those that follow:\n{cause}')

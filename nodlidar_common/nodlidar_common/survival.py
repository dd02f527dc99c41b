"""Lets a node continue after an unexpected error, which is logged and counted."""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import traceback
from typing import Any


class Survival:
    """Counts errors, and logs the first one of each kind.

    Parameters
    ----------
    log
        Called with the message and the traceback of the first error of each kind.

    Attributes
    ----------
    errors
        Number of errors, by their type and the function that raised them.
    """

    def __init__(self, log: Callable[[str], Any]) -> None:
        self.errors: Counter[str] = Counter()
        self._log = log

    @contextmanager
    def surviving(self) -> Iterator[None]:
        """Continue after any error within the context."""
        try:
            yield
        except Exception as error:
            self._count(error)

    def guarded(self, callback: Callable[..., Any]) -> Callable[..., None]:
        """Return a callback that raises nothing."""

        def survive(*arguments: Any) -> None:
            with self.surviving():
                callback(*arguments)

        return survive

    def _count(self, error: Exception) -> None:
        where = traceback.extract_tb(error.__traceback__)[-1].name
        kind = f'{type(error).__name__} in {where}'
        self.errors[kind] += 1
        if self.errors[kind] == 1:
            cause = ''.join(traceback.format_exception(error))
            self._log(f'internal error; the node continues and counts further ones:\n{cause}')

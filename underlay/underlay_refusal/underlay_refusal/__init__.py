"""How an underlay package refuses what it does not cover."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NoReturn, TYPE_CHECKING

__all__ = ['Partial', 'refuse', 'refuse_arguments']

_ADVICE = 'Source a ROS 2 installation for the whole package.'


def refuse(package: str, covered: Iterable[str]) -> Callable[[str], NoReturn]:
    """Make a module's ``__getattr__`` (PEP 562) that names what is missing and what there is.

    Parameters
    ----------
    package
        Dotted name of the module, usually ``__name__``.
    covered
        The public names that it has.

    Returns
    -------
    Callable
        Raises NotImplementedError for any name, except AttributeError for double-underscore
        names, which the import machinery and ``inspect`` look for.

    """
    names = ', '.join(sorted(covered))

    def __getattr__(name: str) -> NoReturn:  # noqa: N807
        if name.startswith('__') and name.endswith('__'):
            raise AttributeError(f'{package!r} has no attribute {name!r}')
        raise NotImplementedError(
            f'{package}.{name} is not covered by the underlay, which has: {names}. {_ADVICE}'
        )

    return __getattr__


def refuse_arguments(called: str, uncovered: Mapping[str, Any]) -> None:
    """Raise NotImplementedError that names the keyword arguments left over, if there are any."""
    if uncovered:
        names = ', '.join(f'{name}=' for name in sorted(uncovered))
        raise NotImplementedError(f'{called}({names}) is not covered by the underlay. {_ADVICE}')


class Partial:
    """Base of a class that has not all of the attributes of the one that it stands in for."""

    if not TYPE_CHECKING:  # a type checker is to find misspelt names

        def __getattr__(self, name: str) -> NoReturn:
            covered = [known for known in dir(self) if not known.startswith('_')]
            return refuse(type(self).__qualname__, covered)(name)

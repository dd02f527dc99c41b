"""Errors of the underlay packages for names and arguments that they do not cover."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NoReturn, TYPE_CHECKING

__all__ = ['Partial', 'refuse', 'refuse_arguments']

_ADVICE = 'Source a ROS 2 installation for the whole package.'


def refuse(package: str, covered: Iterable[str]) -> Callable[[str], NoReturn]:
    """Return a module's ``__getattr__`` (PEP 562) that refuses a name and lists the covered ones.

    Parameters
    ----------
    package
        Dotted name of the module, usually ``__name__``.
    covered
        Its public names.

    Returns
    -------
    Callable
        Raises NotImplementedError for any name, but AttributeError for double-underscore names,
        which the import machinery and ``inspect`` look up.

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
    """Raise NotImplementedError with the names of uncovered keyword arguments, if any."""
    if uncovered:
        names = ', '.join(f'{name}=' for name in sorted(uncovered))
        raise NotImplementedError(f'{called}({names}) is not covered by the underlay. {_ADVICE}')


class Partial:
    """Base of a class that refuses the attributes that it lacks."""

    if not TYPE_CHECKING:  # so that a type checker finds misspelt names

        def __getattr__(self, name: str) -> NoReturn:
            covered = [known for known in dir(self) if not known.startswith('_')]
            return refuse(type(self).__qualname__, covered)(name)

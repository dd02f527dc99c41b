"""How an underlay package refuses what it does not cover."""

from collections.abc import Callable, Iterable
from typing import NoReturn

__all__ = ['refuse']


def refuse(package: str, covered: Iterable[str]) -> Callable[[str], NoReturn]:
    """Make a module's ``__getattr__`` (PEP 562) that names what is missing and what there is.

    Parameters
    ----------
    package
        Dotted name of the module, usually ``__name__``.
    covered
        The public names that the module has.

    Returns
    -------
    Callable
        Raises NotImplementedError for any name, except AttributeError for double-underscore
        names, which the import machinery and ``inspect`` look for.

    """
    names = ', '.join(sorted(covered))

    def __getattr__(name: str) -> NoReturn:  # noqa: N807
        if name.startswith('__') and name.endswith('__'):
            raise AttributeError(f'module {package!r} has no attribute {name!r}')
        raise NotImplementedError(
            f'{package}.{name} is not covered by the underlay, which has: {names}. '
            'Source a ROS 2 installation for the whole package.'
        )

    return __getattr__

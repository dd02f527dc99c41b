r"""Substitutions written in text, as `$(var name)`, for parameter files.

The grammar: `$(name argument ...)` with one space before each argument; an argument is plain, or
in single or double quotes, and may have substitutions in it. A backslash takes the next character
as it is.
"""

from __future__ import annotations

from collections.abc import Callable
import inspect
import re
from typing import TypeVar

from underlay_refusal import refuse

from .substitution import Substitution

__all__ = ['expose_substitution', 'parse_substitution']
__getattr__ = refuse(__name__, __all__)

_Class = TypeVar('_Class', bound=type[Substitution])
_exposed: dict[str, type[Substitution]] = {}


def expose_substitution(name: str) -> Callable[[_Class], _Class]:
    """Make a substitution class known under a name; its arguments are its parameters."""

    def expose(cls: _Class) -> _Class:
        _exposed[name] = cls
        return cls

    return expose


def parse_substitution(text: str) -> list[Substitution]:
    """Return the texts and substitutions that a text is made of.

    Raises
    ------
    ValueError
        When the text has a `$(` that starts no well-formed substitution.
    NotImplementedError
        For a substitution that is not covered.

    """
    return _Parser(text).template()


def _instantiate(name: str, arguments: list[list[Substitution]]) -> Substitution:
    if name not in _exposed:
        covered = ', '.join(sorted(_exposed))
        raise NotImplementedError(f'$({name}) is not covered, only {covered} are')
    parameters = list(inspect.signature(_exposed[name]).parameters)
    if len(arguments) > len(parameters):
        raise ValueError(f'$({name}) takes at most {len(parameters)} arguments')
    return _exposed[name](**dict(zip(parameters, arguments, strict=False)))


class _Parser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0

    def template(self, stop: str = '') -> list[Substitution]:
        """Read up to one of the stop characters, or to the end."""
        from .substitutions import TextSubstitution

        parts: list[Substitution] = []
        plain = ''
        while self._at < len(self._text) and self._text[self._at] not in stop:
            if not self._text.startswith('$(', self._at):
                plain += self._character()
                continue
            parts += [TextSubstitution(text=plain)] if plain else []
            plain = ''
            parts.append(self._substitution())
        return parts if parts and not plain else [*parts, TextSubstitution(text=plain)]

    def _character(self) -> str:
        escaped = re.compile(r'\\(.)').match(self._text, self._at)
        character = escaped[1] if escaped else self._text[self._at]
        self._at += 2 if escaped else 1
        return character

    def _substitution(self) -> Substitution:
        name = self._take(r'\$\(([A-Za-z][A-Za-z0-9_-]*)')
        arguments = []
        while self._text.startswith(' ', self._at):
            self._at += 1
            arguments.append(self._argument())
        self._take(r'(\))')
        return _instantiate(name, arguments)

    def _argument(self) -> list[Substitution]:
        quote = self._text[self._at : self._at + 1]
        if quote not in ('"', "'"):
            return self.template(' )')
        self._at += 1
        argument = self.template(quote)
        self._take(f'({quote})')
        return argument

    def _take(self, pattern: str) -> str:
        match = re.compile(pattern).match(self._text, self._at)
        if match is None:
            near = self._text[self._at : self._at + 20]
            raise ValueError(f'malformed substitution at character {self._at}: {near!r}')
        self._at = match.end()
        return match[1]

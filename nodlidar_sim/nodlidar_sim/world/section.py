"""Reads YAML strictly: a key that is missing, unknown or of a wrong type raises an error."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from nodlidar_common.errors import ParameterError

_REQUIRED: Any = object()
MOST = 1000.0
"""Limit of every length [m], speed [m/s], angle [rad] and other number of a scene."""


class SceneError(ParameterError):
    """An invalid scene; names the file, the key, the limit and the value."""


class Section:
    """A mapping in a YAML file; every read checks the type of the value.

    Parameters
    ----------
    content
        Of the file, at this place.
    file, path
        The place, for errors.

    Raises
    ------
    SceneError
        If the content is no mapping. Every method raises it for a value of a wrong type.
    """

    def __init__(self, content: object, file: str, path: str = '') -> None:
        self._file, self._path = file, path
        if not isinstance(content, dict):
            raise self.error(None, 'a mapping of keys to values', content)
        self._content: dict[str, Any] = content
        self._read: set[str] = set()

    @property
    def name(self) -> str:
        """The name of the file, without its suffix."""
        return self._file.rpartition('.')[0]

    def number(self, key: str, default: float = _REQUIRED, most: float = MOST) -> float:
        """Return a number of at most a given magnitude."""
        value = self._get(key, default)
        if not _is_number(value, most):
            raise self.error(key, f'a number from -{most:g} to {most:g}', value)
        return float(value)

    def truth(self, key: str, default: bool) -> bool:
        """Return true or false."""
        value = self._get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, 'true or false', value)
        return value

    def text(self, key: str) -> str:
        """Return a text."""
        value = self._get(key, _REQUIRED)
        if not isinstance(value, str):
            raise self.error(key, 'a text', value)
        return value

    def vector(self, key: str, names: str, default: tuple[float, ...] = _REQUIRED) -> list[float]:
        """Return a list of as many numbers as names, of magnitudes up to MOST."""
        value = self._get(key, default)
        count = len(names.split())
        is_list = isinstance(value, (list, tuple)) and len(value) == count
        if not is_list or not all(_is_number(number, MOST) for number in value):
            allowed = f'a list of {count} numbers ({names}) from -{MOST:g} to {MOST:g}'
            raise self.error(key, allowed, value)
        return [float(number) for number in value]

    def section(self, key: str, default: object = _REQUIRED) -> Section:
        """Return a mapping."""
        return Section(self._get(key, default), self._file, self._join(key))

    def sections(self, key: str, default: list[object] = _REQUIRED) -> list[Section]:
        """Return a list of mappings, which has at least one unless it is the default."""
        value = self._get(key, default)
        if value is not default and (not isinstance(value, list) or not value):
            raise self.error(key, 'a list with at least one entry', value)
        return [
            Section(entry, self._file, f'{self._join(key)}[{index}]')
            for index, entry in enumerate(value)
        ]

    def has(self, key: str) -> bool:
        """Return whether a key exists, and mark it as known."""
        self._read.add(key)
        return key in self._content

    def names(self) -> list[str]:
        """Return all keys, and mark them as known."""
        self._read.update(self._content)
        return list(self._content)

    def close(self) -> None:
        """Raise SceneError for a key that has not been read or marked as known."""
        for key in self._content:
            if key not in self._read:
                raise self.error(key, 'one of ' + ', '.join(sorted(self._read)), key)

    @contextmanager
    def locating(self) -> Iterator[None]:
        """Add the place in the file to a ParameterError raised inside."""
        try:
            yield
        except SceneError:
            raise
        except ParameterError as error:
            raise self.error(error.key, error.limit, error.value) from error

    def error(self, key: str | None, limit: str, value: object) -> SceneError:
        """Return the error for a key of this section, or for the whole section."""
        path = self._join(key)
        return SceneError(f'{self._file}: {path}' if path else self._file, limit, value)

    def _get(self, key: str, default: Any) -> Any:
        self._read.add(key)
        if key in self._content:
            return self._content[key]
        if default is _REQUIRED:
            raise self.error(key, 'given', None)
        return default

    def _join(self, key: str | None) -> str:
        return '.'.join(part for part in (self._path, key) if part)


def _is_number(value: object, most: float) -> bool:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return is_number and -most <= value <= most  # type: ignore[operator]

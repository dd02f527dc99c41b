"""Namespaces in namespaces."""

from __future__ import annotations


def prefix_namespace(base: str | None, namespace: str | None) -> str | None:
    """Return the namespace in the base, unless it is absolute; None for none."""
    if namespace is None:
        joined = base
    elif not base or namespace.startswith('/'):
        joined = namespace
    else:
        joined = f'{base.rstrip("/")}/{namespace}'
    return joined if joined in (None, '/') else joined.rstrip('/')


def make_namespace_absolute(namespace: str | None) -> str | None:
    """Return the namespace with a slash before it."""
    if namespace is None or namespace.startswith('/'):
        return namespace
    return f'/{namespace}'

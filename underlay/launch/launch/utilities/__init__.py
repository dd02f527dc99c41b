"""Helpers for those who write actions and substitutions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from underlay_refusal import refuse

from ..substitution import SomeSubstitutionsType, Substitution

if TYPE_CHECKING:
    from ..launch_context import LaunchContext

__all__ = ['normalize_to_list_of_substitutions', 'perform_substitutions']
__getattr__ = refuse(__name__, [*__all__, 'type_utils'])


def normalize_to_list_of_substitutions(subs: SomeSubstitutionsType) -> list[Substitution]:
    """Return a list of substitutions from a text, a substitution or several of them.

    Raises
    ------
    TypeError
        When there is anything else, a path for instance.

    """
    if isinstance(subs, (str, Substitution)):
        return [_normalize(subs)]
    return [_normalize(item) for item in subs]


def _normalize(item: str | Substitution) -> Substitution:
    from ..substitutions import TextSubstitution

    if isinstance(item, Substitution):
        return item
    if isinstance(item, str):
        return TextSubstitution(text=item)
    raise TypeError(f"expected a 'str' or a 'launch.Substitution', got a {type(item)}")


def perform_substitutions(context: LaunchContext, subs: Iterable[Substitution]) -> str:
    """Return the texts of the substitutions as one."""
    return ''.join(context.perform_substitution(sub) for sub in subs)

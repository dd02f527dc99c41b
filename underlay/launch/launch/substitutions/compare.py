"""Comparisons, and the choice between two texts."""

from __future__ import annotations

import math
from typing import Any, TYPE_CHECKING

from ..frontend import expose_substitution
from ..substitution import SomeSubstitutionsType, Substitution
from ..utilities import normalize_to_list_of_substitutions, perform_substitutions
from ..utilities.type_utils import is_substitution, perform_typed_substitution
from .substitution_failure import SubstitutionFailure

if TYPE_CHECKING:
    from ..launch_context import LaunchContext

_TRUTHS = {'true': True, '1': True, 'false': False, '0': False}


def _as_text(value: Any) -> Any:
    if is_substitution(value):
        return value
    if value is None:
        return ''
    return str(value).lower() if isinstance(value, bool) else str(value)


def _equal(left: str, right: str) -> bool:
    if left.lower() in _TRUTHS and right.lower() in _TRUTHS:
        return _TRUTHS[left.lower()] == _TRUTHS[right.lower()]
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right


@expose_substitution('equals')
class EqualsSubstitution(Substitution):
    """'true' if two texts, truths or numbers are equal, or else 'false'."""

    def __init__(self, left: Any, right: Any) -> None:
        self.left = normalize_to_list_of_substitutions(_as_text(left))
        self.right = normalize_to_list_of_substitutions(_as_text(right))

    def describe(self) -> str:
        """Describe what is compared."""
        return f'{type(self).__name__}({self.left} {self.right})'

    def _is_equal(self, context: LaunchContext) -> bool:
        left, right = (perform_substitutions(context, x) for x in (self.left, self.right))
        return _equal(left, right)

    def perform(self, context: LaunchContext) -> str:
        """Compare."""
        return str(self._is_equal(context)).lower()


@expose_substitution('not-equals')
class NotEqualsSubstitution(EqualsSubstitution):
    """'false' if two texts, truths or numbers are equal, or else 'true'."""

    def perform(self, context: LaunchContext) -> str:
        """Compare."""
        return str(not self._is_equal(context)).lower()


@expose_substitution('if')
class IfElseSubstitution(Substitution):
    """One of two texts, by the truth of a third."""

    def __init__(
        self,
        condition: SomeSubstitutionsType,
        if_value: SomeSubstitutionsType = '',
        else_value: SomeSubstitutionsType = '',
    ) -> None:
        if if_value == else_value == '':
            raise RuntimeError('One of if_value and else_value must be specified')
        self.condition = normalize_to_list_of_substitutions(condition)
        self.if_value = normalize_to_list_of_substitutions(if_value)
        self.else_value = normalize_to_list_of_substitutions(else_value)

    def describe(self) -> str:
        """Describe the condition and the two texts."""
        return f'IfElseSubstitution({self.condition}, {self.if_value}, {self.else_value})'

    def perform(self, context: LaunchContext) -> str:
        """Return the text that the condition selects."""
        try:
            condition = perform_typed_substitution(context, self.condition, bool)
        except ValueError as error:
            raise SubstitutionFailure(error) from error
        return perform_substitutions(context, self.if_value if condition else self.else_value)

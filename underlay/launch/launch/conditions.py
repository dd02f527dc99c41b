"""Conditions made of text: 'true' and '1' hold, 'false' and '0' don't."""

from __future__ import annotations

from underlay_refusal import refuse

from .condition import Condition
from .launch_context import LaunchContext
from .substitution import SomeSubstitutionsType, Substitution
from .utilities import normalize_to_list_of_substitutions, perform_substitutions

__all__ = [
    'IfCondition',
    'InvalidConditionExpressionError',
    'UnlessCondition',
    'evaluate_condition_expression',
]
__getattr__ = refuse(__name__, __all__)

_TRUTHS = {'true': True, '1': True, 'false': False, '0': False}


class InvalidConditionExpressionError(Exception):
    """A condition's text is neither true nor false."""


def evaluate_condition_expression(context: LaunchContext, expression: list[Substitution]) -> bool:
    """Return the truth of a text, whatever its case and the space around it."""
    text = perform_substitutions(context, expression).strip().lower()
    if text not in _TRUTHS:
        raise InvalidConditionExpressionError(
            f"invalid condition expression, got '{text}', expected one of: {', '.join(_TRUTHS)}"
        )
    return _TRUTHS[text]


class IfCondition(Condition):
    """Holds when its text is true."""

    def __init__(self, predicate_expression: SomeSubstitutionsType) -> None:
        self._expression = normalize_to_list_of_substitutions(predicate_expression)
        super().__init__(predicate=self._is_true)

    def _is_true(self, context: LaunchContext) -> bool:
        return evaluate_condition_expression(context, self._expression)


class UnlessCondition(IfCondition):
    """Holds when its text is false."""

    def _is_true(self, context: LaunchContext) -> bool:
        return not super()._is_true(context)

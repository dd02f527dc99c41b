"""Conditions made of text."""

from underlay_refusal import Partial, refuse

from .launch_context import LaunchContext
from .substitution import normalize, perform, SomeSubstitutionsType

__all__ = ['IfCondition', 'InvalidConditionExpressionError']
__getattr__ = refuse(__name__, __all__)

TRUTHS = {'true': True, '1': True, 'false': False, '0': False}


class InvalidConditionExpressionError(Exception):
    """A condition's text is neither true nor false."""


class IfCondition(Partial):
    """Holds when its text is true, whatever its case and the space around it."""

    def __init__(self, predicate_expression: SomeSubstitutionsType) -> None:
        self._expression = normalize(predicate_expression)

    def evaluate(self, context: LaunchContext) -> bool:
        """Tell if it holds; InvalidConditionExpressionError for a text like neither truth."""
        text = perform(context, self._expression).strip().lower()
        if text not in TRUTHS:
            raise InvalidConditionExpressionError(
                f"invalid condition expression, got '{text}', expected one of {[*TRUTHS]}"
            )
        return TRUTHS[text]

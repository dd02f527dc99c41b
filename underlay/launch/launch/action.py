"""What a launch description consists of."""

from collections.abc import Iterable
from typing import Any

from underlay_refusal import Partial, refuse_arguments

from .launch_context import LaunchContext


class Action(Partial):
    """A step of a launch, done when it is visited."""

    def __init__(self, **uncovered: Any) -> None:
        refuse_arguments(type(self).__name__, uncovered)

    def visit(self, context: LaunchContext) -> Iterable['Action'] | None:
        """Do the step; return what to visit next."""
        raise NotImplementedError

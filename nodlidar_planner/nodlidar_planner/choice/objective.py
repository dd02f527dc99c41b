"""The objective that a nod is chosen by."""

from dataclasses import dataclass
import math

from nodlidar_common.errors import ParameterError

# Default time after which the largest hole counts [s].
HOLE_AFTER = 5.0


@dataclass(frozen=True, slots=True)
class Objective:
    """A weighted sum to minimise.

    Attributes
    ----------
    completion, revisit, hole
        Weights of the completion time [1/s], the longest revisit time [1/s] and the largest hole
        [1/rad].
    hole_after
        Time after which the hole counts [s].
    """

    completion: float = 1.0
    revisit: float = 0.0
    hole: float = 0.0
    hole_after: float = HOLE_AFTER

    def __post_init__(self) -> None:
        weights = self.completion, self.revisit, self.hole
        for key, weight in zip(('completion', 'revisit', 'hole'), weights, strict=True):
            if not 0.0 <= weight < math.inf:
                raise ParameterError(key, 'a weight of at least 0', weight)
        if not any(weights):
            raise ParameterError('objective', 'at least one weight above 0', weights)
        if not 0.0 < self.hole_after < math.inf:
            raise ParameterError('hole_after', 'above 0 s', self.hole_after)

    @property
    def only_completion(self) -> bool:
        """Whether nothing but the completion time counts."""
        return self.revisit == self.hole == 0.0

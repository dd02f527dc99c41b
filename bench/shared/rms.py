"""The root mean square."""

import numpy as np
from numpy.typing import NDArray


def rms(values: NDArray[np.float64]) -> float:
    """Return the root mean square of values, of any shape."""
    return float(np.sqrt(np.mean(np.square(values))))

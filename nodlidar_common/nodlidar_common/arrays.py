"""Types of NumPy arrays."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Times = NDArray[np.int64]
"""Instants [ns]."""
Mask = NDArray[np.bool_]

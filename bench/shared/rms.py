"""Means: of squares, and of rows."""

from collections.abc import Sequence

from nodlidar_common.arrays import Array
import numpy as np

from bench.shared.report import Row


def rms(values: Array) -> float:
    """Return the root mean square of values, of any shape."""
    return float(np.sqrt(np.mean(np.square(values))))


def means(rows: Sequence[Row]) -> Row:
    """Return a row with the mean of each figure of several rows, as of several seeds."""
    return {
        key: value if isinstance(value, str) else float(np.mean([row[key] for row in rows]))
        for key, value in rows[0].items()
    }

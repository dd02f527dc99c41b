"""A scan from above, drawn with characters."""

from nodlidar_common.arrays import Array
import numpy as np

ACROSS, DOWN = 2, 4  # dots of a braille character
_BLANK = 0x2800
# Bits of the dots of a braille character (Unicode block U+2800), by row and column.
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_FARTHEST = 0.98  # share of the points that the picture must hold
_LEAST_SCALE = 0.01  # m


def picture(
    points: Array, columns: int, rows: int, braille: bool = True
) -> tuple[list[str], float]:
    """Return the lines of a picture of points, and the height of a line [m].

    Forward (x) is up, left (y) is left, and the lidar is the `+`. A character is twice as high as
    wide. The farthest 2 % of the points may lie outside.

    Parameters
    ----------
    points
        Points in the scan plane [m], the lidar at 0, shape (n, 2).
    columns, rows
        Size of the picture in characters, each at least 3.
    braille
        Whether to draw eight dots per character; else one.
    """
    across, down = (ACROSS, DOWN) if braille else (1, 1)
    centre = np.array([rows // 2, columns // 2])
    line = _scale(points, columns, rows)
    # Row and column of each point, counted in dots from the top left.
    place = centre + 0.5 - points / (line, line / 2.0)
    dots = np.floor(place * (down, across)).astype(np.int64)
    inside = ((dots >= 0) & (dots < (rows * down, columns * across))).all(axis=1)
    row, column = dots[inside].T
    cells = np.zeros((rows, columns), dtype=np.int64)
    bits = _BITS[row % down, column % across] if braille else np.ones_like(row)
    np.bitwise_or.at(cells, (row // down, column // across), bits)
    shown = [[_character(cell, braille) for cell in each] for each in cells]
    shown[centre[0]][centre[1]] = '+'
    return [''.join(each).rstrip() for each in shown], line


def _character(cell: int, braille: bool) -> str:
    return ' ' if not cell else chr(_BLANK + cell) if braille else '*'


def _scale(points: Array, columns: int, rows: int) -> float:
    """Return the height of a line [m] at which nearly all points fit."""
    if not len(points):
        return 1.0
    needed = np.abs(points) / ((rows - 1) // 2, (columns - 1) // 2 / 2.0)
    return max(float(np.quantile(needed.max(axis=1), _FARTHEST)), _LEAST_SCALE)

"""Shapes of a scene, as in its YAML file."""

from collections.abc import Iterable


def plane(point: Iterable[float], normal: Iterable[float]) -> str:
    """Return a plane through a point x, y, z [m] with a normal."""
    return f'{{plane: {{point: {_floats(point)}, normal: {_floats(normal)}}}}}'


def box(pose: Iterable[float], size: Iterable[float]) -> str:
    """Return a box at x, y, z [m], roll, pitch, yaw [rad], of a size [m]."""
    return f'{{box: {{pose: {_floats(pose)}, size: {_floats(size)}}}}}'


def _floats(values: Iterable[float]) -> list[float]:
    return [float(value) for value in values]

"""Writes a figure into a file."""

from pathlib import Path

from matplotlib.figure import Figure
import matplotlib.pyplot as plt


def save(figure: Figure, path: Path, dpi: int = 110) -> None:
    """Lay a figure out, write it and close it."""
    figure.tight_layout()
    figure.savefig(path, dpi=dpi)
    plt.close(figure)

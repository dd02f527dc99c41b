"""Keyframes, the loops between them, and their poses by least squares."""

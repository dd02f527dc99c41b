"""Poses, small systems of equations, and surfaces as points with normals."""

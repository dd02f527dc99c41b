"""Nodes of the simulation: the base, scans of other lidars, a controlled joint."""

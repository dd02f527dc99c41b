"""Nods whose sweeps differ: interlaced ones, and sweeps chosen for the cells not seen yet."""

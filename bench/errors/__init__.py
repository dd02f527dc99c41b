"""Errors of pitch and points, and what estimates or removes them."""

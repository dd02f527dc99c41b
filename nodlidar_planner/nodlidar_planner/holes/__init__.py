"""The largest hole that a pattern leaves after a time."""

"""The launch command."""

"""Checks of devices, computer and running system: facts in, findings out."""

"""Emulated servos and lidars, and the effects of the simulator."""

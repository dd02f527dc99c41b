"""Ports of the devices: in virtual time, or on pseudo-terminals."""

"""The ports that drivers reach emulated devices through: in virtual time, or as real terminals."""

from nodlidar_sim.pseudo_terminals import PseudoTerminals
from nodlidar_sim.virtual_port import VirtualClock, VirtualPort

__all__ = ['PseudoTerminals', 'VirtualClock', 'VirtualPort']

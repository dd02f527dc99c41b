"""Diagnostics of a node, collected from tasks: what nodlidar calls of Jazzy's API."""

from diagnostic_updater._status import DiagnosticStatusWrapper
from diagnostic_updater._updater import Updater
from underlay_refusal import refuse

__all__ = ['DiagnosticStatusWrapper', 'Updater']
__getattr__ = refuse(__name__, __all__)

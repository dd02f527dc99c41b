"""Diagnostics of a node, collected from tasks and published: the Python API of Jazzy."""

from diagnostic_updater._monitors import (
    FrequencyStatus,
    FrequencyStatusParam,
    Heartbeat,
    TimeStampStatus,
    TimeStampStatusParam,
)
from diagnostic_updater._status import DiagnosticStatusWrapper
from diagnostic_updater._tasks import (
    CompositeDiagnosticTask,
    DiagnosticTask,
    FunctionDiagnosticTask,
)
from diagnostic_updater._topics import (
    DiagnosedPublisher,
    HeaderlessTopicDiagnostic,
    TopicDiagnostic,
)
from diagnostic_updater._updater import Updater
from underlay_refusal import refuse

__all__ = [
    'CompositeDiagnosticTask',
    'DiagnosedPublisher',
    'DiagnosticStatusWrapper',
    'DiagnosticTask',
    'FrequencyStatus',
    'FrequencyStatusParam',
    'FunctionDiagnosticTask',
    'HeaderlessTopicDiagnostic',
    'Heartbeat',
    'TimeStampStatus',
    'TimeStampStatusParam',
    'TopicDiagnostic',
    'Updater',
]
__getattr__ = refuse(__name__, __all__)

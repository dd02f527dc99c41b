"""Meaning of the lidar's two-character status codes (SCIP 2.0 specification, C-42-03320B)."""

OK = '00'
LASER_WAS_ON = '02'
TIME_MODE_WAS_ON = '02'
TIME_MODE_WAS_OFF = '03'
SCAN_DATA = '99'
RESUMED = '98'
NOT_IN_THIS_STATE = '0E'
SCIP_1_1_ERROR = 'E'

_ANY_COMMAND = {
    '0A': 'internal error of the lidar',
    '0B': "the lidar's buffer is short, or the command was repeated",
    '0C': 'too few parameters',
    '0D': 'undefined command or parameter',
    '0E': 'undefined command, or not allowed in this state',
    '0F': 'too few parameters',
    '0G': 'the string after the command is too long',
    '0H': 'the string after the command has invalid letters',
    '0I': 'the lidar is in firmware update mode',
}
_BY_COMMAND = {
    'BM': {'01': 'the laser is faulty and cannot be turned on'},
    'TM': {'01': 'invalid time mode code', '04': 'time mode is off'},
    'MD': {
        '01': 'start step is not numeric',
        '02': 'end step is not numeric',
        '03': 'cluster is not numeric',
        '04': 'end step is out of range',
        '05': 'end step is before start step',
        '06': 'scan interval is not numeric',
        '07': 'number of scans is not numeric',
    },
}


def meaning(command: str, status: str) -> str:
    """Return the meaning of a status as the answer to a command."""
    if command.startswith('MD'):
        if is_verifying(status):
            return 'measurement stopped to verify an error'
        if is_fault(status):
            return 'measurement stopped: hardware fault (laser, motor or electronics)'
    specific = _BY_COMMAND.get(command[:2], {})
    return specific.get(status) or _ANY_COMMAND.get(status, 'unknown status')


def is_verifying(status: str) -> bool:
    """Return whether the status of a scan means that the lidar stopped to verify an error."""
    return _is_number(status) and 21 <= int(status) <= 49


def is_fault(status: str) -> bool:
    """Return whether the status of a scan means that the hardware failed."""
    return _is_number(status) and 50 <= int(status) <= 97


def _is_number(status: str) -> bool:
    return len(status) == 2 and status.isdecimal()

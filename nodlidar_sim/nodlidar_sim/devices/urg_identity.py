"""The replies of an emulated URG-04LX-UG01 to VV, PP and II."""

from nodlidar_common.scip import information_line
from nodlidar_sim.devices.urg_scan import (
    FIRST_STEP,
    FRONT_STEP,
    LAST_STEP,
    MAX_RANGE_MM,
    MIN_RANGE_MM,
    STEPS_PER_REVOLUTION,
)

MODEL = 'URG-04LX-UG01(Simple-URG)(Hokuyo Automatic Co.,Ltd.)'
SERIAL_NUMBER = 'H0000001'
STANDARD_SPEED = 600  # rpm


def version_lines() -> list[bytes]:
    """Return the lines of VV."""
    return _lines(
        VEND='Hokuyo Automatic Co.,Ltd.',
        PROD='SOKUIKI Sensor URG-04LX-UG01(Simple-URG)',
        FIRM='3.4.03(17/Dec./2012)',
        PROT='SCIP 2.0',
        SERI=SERIAL_NUMBER,
    )


def parameter_lines() -> list[bytes]:
    """Return the lines of PP."""
    return _lines(
        MODL=MODEL,
        DMIN=MIN_RANGE_MM,
        DMAX=MAX_RANGE_MM,
        ARES=STEPS_PER_REVOLUTION,
        AMIN=FIRST_STEP,
        AMAX=LAST_STEP,
        AFRT=FRONT_STEP,
        SCAN=STANDARD_SPEED,
    )


def status_lines(
    laser: bool, measuring: bool, speed: int, bit_rate: str, timer: int, status: str
) -> list[bytes]:
    """Return the lines of II; the speed is in rpm, the timer in ms."""
    return _lines(
        MODL=MODEL,
        LASR='ON' if laser else 'OFF',
        SCSP=f'{_speed_level(speed)}({speed}[rpm])',
        MESM='Measuring by Normal Mode' if measuring else 'IDLE',
        SBPS=bit_rate,
        TIME=f'{timer:06X}',
        STAT=status,
    )


def _speed_level(speed: int) -> str:
    """Return a motor speed [rpm] relative to the standard one, in the form hokuyoaist reads."""
    if speed == STANDARD_SPEED:
        return 'Initial'
    return f'{round(100.0 * (1.0 - speed / STANDARD_SPEED))}%Down'


def _lines(**values: object) -> list[bytes]:
    return [information_line(key, str(value)) for key, value in values.items()]

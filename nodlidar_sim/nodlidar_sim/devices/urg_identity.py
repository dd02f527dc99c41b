"""The replies of an emulated lidar to VV, PP and II."""

from nodlidar_common.scip import information_line
from nodlidar_sim.devices.scip_models import ScipModel

SERIAL_NUMBER = 'H0000001'


def version_lines(model: ScipModel) -> list[bytes]:
    """Return the lines of VV."""
    return _lines(
        VEND='Hokuyo Automatic Co.,Ltd.',
        PROD=model.product,
        FIRM=model.firmware,
        PROT='SCIP 2.0',
        SERI=SERIAL_NUMBER,
    )


def parameter_lines(model: ScipModel) -> list[bytes]:
    """Return the lines of PP."""
    return _lines(
        MODL=model.name,
        DMIN=model.range_min_mm,
        DMAX=model.range_max_mm,
        ARES=model.steps_per_revolution,
        AMIN=model.first_step,
        AMAX=model.last_step,
        AFRT=model.front_step,
        SCAN=model.speed,
    )


def status_lines(
    model: ScipModel,
    laser: bool,
    measuring: bool,
    speed: int,
    bit_rate: str,
    timer: int,
    status: str,
) -> list[bytes]:
    """Return the lines of II; the speed is in rpm, the timer in ms."""
    return _lines(
        MODL=model.name,
        LASR='ON' if laser else 'OFF',
        SCSP=f'{_speed_level(speed, model.speed)}({speed}[rpm])',
        MESM='Measuring by Normal Mode' if measuring else 'IDLE',
        SBPS=bit_rate,
        TIME=f'{timer:06X}',
        STAT=status,
    )


def _speed_level(speed: int, standard: int) -> str:
    """Return a motor speed [rpm] relative to the standard one, in the form hokuyoaist reads."""
    if speed == standard:
        return 'Initial'
    return f'{round(100.0 * (1.0 - speed / standard))}%Down'


def _lines(**values: object) -> list[bytes]:
    return [information_line(key, str(value)) for key, value in values.items()]

"""Parameters of the nod command, and of the object to be found."""

from dataclasses import dataclass
import math

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_planner.pattern.nod_speeds import (
    MAX_ACCELERATION,
    MAX_SPEED,
    shortest_by_mean_speed,
    TIMING_ERROR,
)
from nodlidar_planner.pattern.task import Task

NOD_MODES = ('coprime', 'feedback', 'interlaced')
LEAST_SPAN = 1e-6  # of the nod [rad]
_TASK = Task()


@dataclass(frozen=True)
class NodConfig:
    """Nod command, and the object to be found."""

    command_nod: bool = parameter(
        True,
        'Command the nod; if false, only assemble clouds',
    )
    pitch_min: float = parameter(
        _TASK.pitch_min,
        'Lower limit of the nod',
        unit='rad',
        minimum=-1.6,
        maximum=1.6,
        live=True,
    )
    pitch_max: float = parameter(
        _TASK.pitch_max,
        'Upper limit of the nod',
        unit='rad',
        minimum=-1.6,
        maximum=1.6,
        live=True,
    )
    samples_per_sweep: int = parameter(
        7547,  # what plan_scan chooses for these parameters
        'N_s: lidar steps in one sweep, from one limit to the other, dark steps included; '
        'coprime with steps_per_revolution',
        minimum=1,
        maximum=10_000_000,
        live=True,
    )
    steps_per_revolution: int = parameter(
        _TASK.steps_per_revolution,
        'N_L: lidar steps in a revolution, dark steps included; if scans show another number, '
        'that one counts, and N_s is adjusted to it',
        minimum=1,
        maximum=65_536,
    )
    nod_mode: str = parameter(
        'coprime',
        'coprime: the planned nod, phase-locked to the lidar; feedback: each sweep lengthened or '
        'shortened so that beams hit cells not seen yet; interlaced: slow sweeps up, of at most '
        'samples_per_sweep, that lie between each other, and fast returns',
        choices=NOD_MODES,
        live=True,
    )
    command_rate: float = parameter(
        5.0,
        'Repetition rate of the nod command',
        unit='Hz',
        minimum=1.0,
        maximum=100.0,
    )
    scan_timeout: float = parameter(
        2.0,
        'Time without a scan after which the nod command is no longer repeated, so that the '
        'servo lets go',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    max_nod_speed: float = parameter(
        MAX_SPEED,
        'Mean speed of a sweep that the servo reaches, braking at its ends included; N_s rises '
        'where adapted limits would exceed it',
        unit='rad/s',
        minimum=0.01,
        maximum=100.0,
    )
    max_nod_acceleration: float = parameter(
        MAX_ACCELERATION,
        'Acceleration that a nod may need, three quarters of what the servo reaches; assumed for '
        'an RX-24F, not measured. N_s rises where a reversal would take more than the whole '
        'sweep, as with narrow limits',
        unit='rad/s^2',
        minimum=1.0,
        maximum=10_000.0,
    )
    timing_error: float = parameter(
        TIMING_ERROR,
        "Standard deviation of the servo's reversal times; the choice of N_s for adapted limits "
        'allows for it',
        unit='s',
        minimum=0.0,
        maximum=0.1,
    )
    object_size: float = parameter(
        _TASK.object_size,
        'Smallest object to be seen; sets the size of the coverage cells',
        unit='m',
        minimum=0.02,
        maximum=10.0,
        live=True,
    )
    object_distance: float = parameter(
        _TASK.distance,
        'Distance up to which the smallest object is to be seen',
        unit='m',
        minimum=0.05,
        maximum=10.0,
        live=True,
    )

    @property
    def task(self) -> Task:
        """The smallest object, at the greatest distance, between the limits, as cells."""
        return Task(
            object_size=self.object_size,
            distance=self.object_distance,
            pitch_min=self.pitch_min,
            pitch_max=self.pitch_max,
            steps_per_revolution=self.steps_per_revolution,
        )

    def fewest_samples(self, span: float, beam_period: float) -> int:
        """Return the least N_s with which the servo gets over a span [rad].

        The beam period [s] counts dark steps.
        """
        sweep = shortest_by_mean_speed(span, self.max_nod_speed, self.max_nod_acceleration)
        return math.ceil(sweep / beam_period)

    def check_together(self) -> None:
        """Raise ParameterError for limits without a span, or an object that cannot be seen."""
        if self.pitch_max - self.pitch_min < LEAST_SPAN:
            limit = f'at least {LEAST_SPAN} rad above pitch_min = {self.pitch_min} rad'
            raise ParameterError('pitch_max', limit, self.pitch_max)
        if self.object_size > 2.0 * self.object_distance:
            limit = f'at most twice object_distance = {self.object_distance} m'
            raise ParameterError('object_size', limit, self.object_size)

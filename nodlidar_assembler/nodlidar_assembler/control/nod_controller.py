"""Which nod to command: the planned one, or sweep by sweep the one for what is unseen."""

from dataclasses import dataclass, replace
import math

from nodlidar_assembler.clouds.geometry import Beams, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.control.chosen_sweeps import ChosenSweeps
from nodlidar_assembler.control.nod_adaptation import fewest_samples
from nodlidar_assembler.control.nod_clock import NodClock, NodShape
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NodTrajectory
from nodlidar_common.parameters import parameter
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.schedule import even_rows, shortest_interlaced
import numpy as np
from numpy.typing import NDArray

# Of interlaced sweeps: takes up what the servo is off, in the rows of the slowest N_s and others.
OVERLAP = 0.3


NOD_MODES = ('coprime', 'feedback', 'interlaced')
LEAST_SPAN = 1e-6  # of the nod [rad]


@dataclass(frozen=True)
class NodConfig:
    """Nod command, and the object to be found."""

    command_nod: bool = parameter(
        True,
        'Command the nod; if false, only assemble clouds',
    )
    pitch_min: float = parameter(
        -0.6136, 'Lower limit of the nod', unit='rad', minimum=-1.6, maximum=1.6
    )
    pitch_max: float = parameter(
        0.6136, 'Upper limit of the nod', unit='rad', minimum=-1.6, maximum=1.6
    )
    samples_per_sweep: int = parameter(
        4001,
        'N_s: lidar steps in one sweep, from one limit to the other, dark steps included; '
        'coprime with steps_per_revolution',
        minimum=1,
        maximum=10_000_000,
    )
    steps_per_revolution: int = parameter(
        1024,
        'N_L: lidar steps in a revolution, dark steps included',
        minimum=1,
        maximum=65_536,
    )
    nod_mode: str = parameter(
        'coprime',
        'coprime: the planned nod, phase-locked to the lidar; feedback: each sweep lengthened or '
        'shortened so that beams hit cells not seen yet; interlaced: slow sweeps up, of at most '
        'samples_per_sweep, that lie between each other, and fast returns',
        choices=NOD_MODES,
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
        6.0,
        'Speed that the servo can hold; N_s rises where adapted limits would exceed it',
        unit='rad/s',
        minimum=0.01,
        maximum=100.0,
    )
    max_nod_acceleration: float = parameter(
        150.0,
        'Acceleration that the servo reaches for certain; N_s rises where a reversal would take '
        'more than the whole sweep, as with narrow limits',
        unit='rad/s^2',
        minimum=1.0,
        maximum=10_000.0,
    )
    timing_error: float = parameter(
        0.003,
        "Standard deviation of the servo's reversal times; the choice of N_s for adapted limits "
        'allows for it',
        unit='s',
        minimum=0.0,
        maximum=0.1,
    )
    object_size: float = parameter(
        0.1,
        'Smallest object to be seen; sets the size of the coverage cells',
        unit='m',
        minimum=0.02,
        maximum=10.0,
    )
    object_distance: float = parameter(
        2.0,
        'Distance up to which the smallest object is to be seen',
        unit='m',
        minimum=0.05,
        maximum=10.0,
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

    def check_together(self) -> None:
        """Raise ParameterError for limits without a span, or an object that cannot be seen."""
        if self.pitch_max - self.pitch_min < LEAST_SPAN:
            limit = f'at least {LEAST_SPAN} rad above pitch_min = {self.pitch_min} rad'
            raise ParameterError('pitch_max', limit, self.pitch_max)
        if self.object_size > 2.0 * self.object_distance:
            limit = f'at most twice object_distance = {self.object_distance} m'
            raise ParameterError('object_size', limit, self.object_size)


class NodController:
    """Keeps the nod tied to the lidar's clock, whatever shape it is to have.

    With nod_mode 'coprime' it is the planned nod for as long as its shape stays. With 'feedback'
    every sweep is chosen for the cells that are unseen; with 'interlaced' slow sweeps up, of N_s
    at most, lie between each other, and returns are fast. A new shape begins with the planned nod.

    Parameters
    ----------
    config
        Of the assembler.
    """

    def __init__(self, config: NodConfig) -> None:
        self._config = config
        self._clock = NodClock(
            NodShape(config.pitch_min, config.pitch_max, config.samples_per_sweep),
            config.steps_per_revolution,
        )
        self._sweeps: ChosenSweeps | None = None

    @property
    def shape(self) -> NodShape:
        """Limits and N_s that are planned."""
        return self._clock.shape

    @property
    def command(self) -> tuple[NodTrajectory, int] | None:
        """The nod and the instant from which it counts [ns]; None before the first scan."""
        if self._sweeps is not None:
            return self._sweeps.nod, self._sweeps.start_ns
        return None if self._clock.nod is None else (self._clock.nod, 0)

    @property
    def round_time(self) -> float:
        """How long it took to see all cells the last time [s]; NaN if they are not told of."""
        return math.nan if self._sweeps is None else self._sweeps.round_time

    def add_scan(self, geometry: ScanGeometry, stamp_ns: int) -> None:
        """Follow the lidar's clock; see NodClock.add_scan.

        When that begins anew, so does the choice of sweeps: the last one may be for a time that is
        far ahead now.
        """
        lidar = self._clock.revolutions
        restarts = lidar.restarts
        self._clock.add_scan(geometry, stamp_ns)
        if self._sweeps is not None and lidar.restarts > restarts:
            self._begin_anew(self.shape, lidar.begin_ns)

    def shift(self, step_ns: int) -> None:
        """Go on as before although the clock was set by a step [ns]."""
        self._clock.shift(step_ns)
        if self._sweeps is not None:
            self._sweeps.shift(step_ns)

    def change(self, shape: NodShape, now_ns: int) -> bool:
        """Take another shape at an instant [ns]; return whether it is another."""
        if shape == self.shape:
            return False
        self._begin_anew(shape, now_ns)
        return True

    def _begin_anew(self, shape: NodShape, now_ns: int) -> None:
        """Go on with the planned nod of a shape from where the nod is at an instant [ns]."""
        self._clock.change(shape, now_ns, self._sweeps.nod_at(now_ns) if self._sweeps else None)
        self._sweeps = None

    def saw(self, scan: Scan, beams: Beams, pitch: NDArray[np.float64], now_ns: int) -> bool:
        """Tell where the beams of a scan went; return whether a sweep was chosen.

        Parameters
        ----------
        scan, beams, pitch
            The scan, its beams and their pitch [rad].
        now_ns
            The present time [ns].

        Raises
        ------
        ParameterError
            If sweeps cannot be chosen for this lidar, or not be interlaced with so few samples;
            see ChosenSweeps.choose and shortest_interlaced. The nod is the planned one then.
        """
        if self._config.nod_mode == 'coprime' or self._clock.nod is None:
            return False
        if self._sweeps is None:
            self._sweeps = self._begin(self._clock.nod)
        self._sweeps.saw(scan.stamp_ns + beams.offset_ns, beams.azimuth, pitch)
        try:
            return self._sweeps.choose(now_ns, self._clock.revolutions, scan.geometry)
        except ParameterError:
            self._sweeps = None
            raise

    def _begin(self, planned: NodTrajectory) -> ChosenSweeps:
        config = self._config
        task = replace(config.task, pitch_min=planned.pitch_min, pitch_max=planned.pitch_max)
        beam_period = planned.sweep_duration / planned.samples_per_sweep
        fewest = fewest_samples(
            planned.span, config.max_nod_speed, config.max_nod_acceleration, beam_period
        )
        schedule = None
        if config.nod_mode == 'interlaced':
            most = planned.samples_per_sweep
            schedule = shortest_interlaced(even_rows(task), fewest, most, OVERLAP)
        return ChosenSweeps(task, planned, config.timing_error, fewest, schedule)

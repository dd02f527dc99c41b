"""The nod to command, whatever it is chosen by."""

from dataclasses import replace
import math

from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_assembler.clouds.geometry import Beams, revolution_time, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.control.adaptive_limits import AdaptiveLimits, AdaptiveLimitsConfig
from nodlidar_assembler.control.chosen_sweeps import ChosenSweeps
from nodlidar_assembler.control.lidar_view import LidarView
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.phase_lock import PhaseLock
from nodlidar_assembler.control.takeover import Takeover
from nodlidar_common.arrays import Array
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_planner.sweeps.schedule import even_rows, shortest_interlaced

# Neighbouring interlaced sweeps overlap by this share of a row of the slowest N_s, for the error
# of the servo.
OVERLAP = 0.3


class NodController:
    """Owns the nod: selects what is commanded, and keeps it phase-locked to the lidar.

    Its limits are the planned ones, or follow the range ahead. With nod_mode 'coprime' it is the
    same nod for as long as its shape stays. With 'feedback' every sweep is chosen for the unseen
    cells; with 'interlaced' slow sweeps up, of at most N_s, lie between each other, and returns
    are fast. A new shape begins with a steady nod. A nod that takes over is steady, whatever the
    mode, until it is given back.

    Attributes
    ----------
    view
        The planned nod, and the cells in the whole window, for the lidar that sends the scans.
    """

    def __init__(self, config: AdaptiveLimitsConfig) -> None:
        self.view = LidarView(config)
        self._lock = PhaseLock(self.planned, config.steps_per_revolution)
        self._sweeps: ChosenSweeps | None = None
        self._takeover: Takeover | None = None
        self.configure_limits(config)

    def configure_limits(self, config: AdaptiveLimitsConfig) -> None:
        """Let the limits follow the range from now on, or not, as configured."""
        self._limits = AdaptiveLimits(config) if config.adapt_limits else None

    @property
    def planned(self) -> NodShape:
        """The planned limits and N_s."""
        config = self.view.config
        return NodShape(config.pitch_min, config.pitch_max, config.samples_per_sweep)

    @property
    def shape(self) -> NodShape:
        """Limits and N_s at present."""
        return self._lock.shape

    @property
    def command(self) -> tuple[Nod, int] | None:
        """The nod and the instant from which it counts [ns]; None before the first scan."""
        if self._sweeps is not None:
            return self._sweeps.nod, self._sweeps.start_ns
        if self._takeover is not None and self._lock.nod is not None:
            return self._takeover.command(self._lock.nod)
        return None if self._lock.nod is None else (self._lock.nod, 0)

    @property
    def round_time(self) -> float:
        """Duration of the last complete round [s]; NaN before, and with nod_mode 'coprime'."""
        return math.nan if self._sweeps is None else self._sweeps.round_time

    def add_scan(self, geometry: ScanGeometry, stamp_ns: int) -> None:
        """Follow the lidar's clock; see PhaseLock.add_scan.

        When it restarts, so does the choice of sweeps: the last one may now begin far ahead. So it
        does when another lidar is seen, whose steps per revolution count then; a nod that took
        over ends.
        """
        if self._takeover is not None:
            self._takeover.approaching = False
        lidar = self._lock.revolutions
        restarts = lidar.restarts
        self._lock.add_scan(geometry, stamp_ns)
        looked = self.view.look(geometry)
        taken = self._takeover is not None
        if looked and (taken or self.view.config.steps_per_revolution != self._lock.steps):
            self._lock.steps = self.view.config.steps_per_revolution
            lidar.restart(stamp_ns, revolution_time(geometry))
            shape = replace(self.shape, samples_per_sweep=self.view.config.samples_per_sweep)
            self._continue_steady(self.planned if taken else shape, lidar.begin_ns)
        elif self._sweeps is not None and (looked or lidar.restarts > restarts):
            self._continue_steady(self.shape, lidar.begin_ns)

    def shift(self, step_ns: int) -> None:
        """Continue as before after the clock was set by a step [ns]; adapted limits restart."""
        self._lock.shift(step_ns)
        if self._limits is not None:
            self._limits.restart()
        if self._sweeps is not None:
            self._sweeps.shift(step_ns)
        if self._takeover is not None:
            self._takeover.shift(step_ns)

    @property
    def taken_over(self) -> bool:
        """Whether a nod that took over is commanded; not with another lidar than it is for."""
        return self._takeover is not None

    @property
    def approaching(self) -> bool:
        """Whether the command is still the way to a nod that takes over, until the next scan."""
        return self._takeover is not None and self._takeover.approaching

    def take_over(self, shape: NodShape, now_ns: int) -> int:
        """Nod with a shape from its nearer limit on; return when it is there [ns].

        Until `give_back`, neither limits nor sweeps change. The servo needs two commands: the way
        to the limit, at once, and from the next scan on the nod.

        Raises
        ------
        ParameterError
            If there is no nod yet, since no scan has come.
        """
        present = self._nod_at(now_ns)
        if present is None:
            raise ParameterError('scan', 'received before the nod can be taken over', None)
        self._takeover = Takeover(present, shape, now_ns, self.view.config)
        self._sweeps = None
        self._lock.begin(shape, self._takeover.place, self._takeover.begin_ns)
        return self._takeover.begin_ns

    def give_back(self, now_ns: int) -> None:
        """Return to the planned nod, if another one took over."""
        if self._takeover is not None:
            self._continue_steady(self.planned, now_ns)

    def follow_range(self, assembled: Assembled, odometry: Odometry | None, now_ns: int) -> bool:
        """Take the limits for a scan, or the planned ones; return whether the nod is another."""
        shape: NodShape | None = None
        if self._limits is not None:
            self._limits.add(assembled, odometry)
            shape = self._limits.shape()
        return self.change(shape or self.planned, now_ns)

    def change(self, shape: NodShape, now_ns: int) -> bool:
        """Apply a shape at an instant [ns]; return whether it is another one."""
        if shape == self.shape or self._takeover is not None:
            return False
        self._continue_steady(shape, now_ns)
        return True

    def reconfigure(self, config: AdaptiveLimitsConfig, now_ns: int) -> None:
        """Continue with another planned nod from the pitch at an instant [ns].

        If another nod took over, the planned one counts when it is given back.
        """
        self.view.reconfigure(config)
        self.configure_limits(config)
        self._lock.steps = self.view.config.steps_per_revolution
        if self._takeover is None:
            self._continue_steady(self.planned, now_ns)

    def _continue_steady(self, shape: NodShape, now_ns: int) -> None:
        """Continue with the planned nod of a shape from the pitch at an instant [ns]."""
        self._lock.change(shape, now_ns, self._nod_at(now_ns))
        self._sweeps = self._takeover = None

    def _nod_at(self, time_ns: int) -> Nod | None:
        """Return the nod at an instant [ns]; the one commanded last may begin later."""
        if self._sweeps is not None:
            return self._sweeps.nod_at(time_ns)
        if self._takeover is not None and time_ns < self._takeover.begin_ns:
            return self._takeover.approach
        return self._lock.nod

    def add_beams(self, stamp_ns: int, beams: Beams, pitch: Array, now_ns: int) -> bool:
        """Mark the cells that the beams of a scan hit; return whether a sweep was chosen.

        Parameters
        ----------
        stamp_ns
            Instant of the scan's first beam [ns].
        beams, pitch
            The scan's beams and their pitch [rad], shape (n,).
        now_ns
            The present time [ns].

        Raises
        ------
        ParameterError
            If sweeps cannot be chosen for this lidar, or not be interlaced with so few samples;
            see ChosenSweeps.choose and shortest_interlaced. The nod is then the planned one.
        """
        planned = self.view.config.nod_mode == 'coprime' or self._takeover is not None
        if planned or self._lock.nod is None:
            return False
        if self._sweeps is None:
            self._sweeps = self._begin(self._lock.nod)
        self._sweeps.add_beams(stamp_ns + beams.offset_ns, beams.azimuth, pitch)
        try:
            return self._sweeps.choose(now_ns, self._lock.revolutions, beams.geometry)
        except ParameterError:
            self._sweeps = None
            raise

    def _begin(self, planned: Nod) -> ChosenSweeps:
        config = self.view.config
        task = replace(self.view.task, pitch_min=planned.pitch_min, pitch_max=planned.pitch_max)
        beam_period = planned.sweep_duration / planned.samples_per_sweep
        fewest = config.fewest_samples(planned.span, beam_period)
        schedule = None
        if config.nod_mode == 'interlaced':
            most = planned.samples_per_sweep
            schedule = shortest_interlaced(even_rows(task), fewest, most, OVERLAP)
        return ChosenSweeps(task, planned, config.timing_error, fewest, schedule)

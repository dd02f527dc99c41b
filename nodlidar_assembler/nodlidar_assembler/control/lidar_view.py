"""The lidar as its scans show it: steps per revolution, window and rate.

Coverage, feedback and the choice of N_s are for these, whichever lidar is configured.
"""

from dataclasses import fields, replace
import math

from nodlidar_assembler.clouds.geometry import revolution_time, ScanGeometry
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_assembler.inputs.revolutions import SAME_RATE
from nodlidar_common.parameters import limits_of
from nodlidar_planner.pattern.band import coprime_from
from nodlidar_planner.pattern.task import Task, wrapped

# Shares by which steps may differ from scan to scan, and steps by which an end of the window may:
# they are those of the first scan then. Small lidars of the full circle measure at a fixed rate
# while their speed drifts.
SAME, SAME_DRIFTING, SAME_STEPS = 0.01, 0.1, 2.5
# A window with a gap of fewer steps than this is the full circle.
GAP = 1.5
_LIMITS = {field.name: limits_of(field) for field in fields(Task)}


class LidarView:
    """What is planned for, from the first scan on for the lidar that sent it.

    Parameters
    ----------
    config
        Planned nod; its N_L counts until a scan shows another one.

    Attributes
    ----------
    config
        The nod for the lidar's N_L; see `nod_for`.
    task
        Cells in the whole window of the lidar; see `task_for`.
    """

    def __init__(self, config: NodConfig) -> None:
        self.config, self.task = config, config.task
        self._configured = config
        self._geometry: ScanGeometry | None = None

    @property
    def step(self) -> float:
        """Angle between two beams [rad]; 0 before the first scan."""
        return abs(self._geometry.angle_increment) if self._geometry is not None else 0.0

    def reconfigure(self, config: NodConfig) -> None:
        """Plan another nod, for the same lidar."""
        geometry, self._geometry = self._geometry, None
        self.config, self.task = config, config.task
        self._configured = config
        if geometry is not None:
            self.look(geometry)

    def look(self, geometry: ScanGeometry) -> bool:
        """Take note of a scan's geometry; return whether its lidar is another one than before."""
        if geometry == self._geometry:
            return False
        known, self._geometry = self._geometry is not None, geometry
        config = self.config
        drifting = known and self.task.full_circle and is_full_circle(geometry)
        same = SAME_DRIFTING if drifting else SAME
        if not has_steps(geometry, config.steps_per_revolution, same):
            config = nod_for(self._configured, geometry)
        task = task_for(config, geometry)
        if known and _is_alike(task, self.task):
            return False
        self.config, self.task = config, task
        return True


def is_full_circle(geometry: ScanGeometry) -> bool:
    """Return whether beams go all around, but for a gap between the last and the first."""
    return (geometry.beams - 1 + GAP) * abs(geometry.angle_increment) >= math.tau


def has_steps(geometry: ScanGeometry, steps_per_revolution: int, same: float = SAME) -> bool:
    """Return whether a lidar may have so many steps; it may send only every second, third ... ."""
    implied = math.tau / abs(geometry.angle_increment)
    thinned = max(round(steps_per_revolution / implied), 1)
    return abs(steps_per_revolution / (thinned * implied) - 1.0) <= same


def nod_for(config: NodConfig, geometry: ScanGeometry) -> NodConfig:
    """Return the nod for a lidar of another N_L: of the same speed, and coprime.

    The configured N_s is for the usual rate of revolutions. It rises where the servo needs more.
    An N_L out of its range is ignored.
    """
    steps = round(math.tau / abs(geometry.angle_increment))
    most = limits_of(config.__dataclass_fields__['steps_per_revolution']).maximum
    if has_steps(geometry, config.steps_per_revolution) or steps > (most or 0):
        return config
    beam_period = 1.0 / (_rate(config.task, geometry) * steps)
    fewest = config.fewest_samples(config.pitch_max - config.pitch_min, beam_period)
    samples = max(round(config.samples_per_sweep * config.task.beam_period / beam_period), fewest)
    samples = coprime_from(max(samples, 1), steps)
    return replace(config, steps_per_revolution=steps, samples_per_sweep=samples)


def task_for(config: NodConfig, geometry: ScanGeometry) -> Task:
    """Return the cells in the window of a lidar, from its first to its last beam."""
    step = math.tau / config.steps_per_revolution
    increment, beams = abs(geometry.angle_increment), geometry.beams
    # Whole steps: angles of messages are rounded.
    width = round((beams - 1) * increment / step) * step
    last = geometry.angle_min + (beams - 1) * geometry.angle_increment
    first = wrapped(min(geometry.angle_min, last))
    full_circle = is_full_circle(geometry)
    if full_circle:
        width = math.tau - step
    return replace(
        config.task,
        azimuth=max(width / 2.0, _LIMITS['azimuth'].minimum or 0.0),
        centre=wrapped(first + width / 2.0),
        window_min=first,
        window_max=first + width,
        azimuth_of_step_0=first,
        full_circle=full_circle,
        scan_rate=_rate(config.task, geometry),
    )


def _rate(task: Task, geometry: ScanGeometry) -> float:
    """Return the revolutions per second [Hz]; the usual ones where scans do not state them."""
    period = revolution_time(geometry)
    return 1.0 / period if period > 0.0 else task.scan_rate


def _is_alike(task: Task, other: Task) -> bool:
    """Return whether tasks are for the same lidar, but for what differs from scan to scan."""
    step = math.tau / task.steps_per_revolution
    ends = task.window_min - other.window_min, task.window_max - other.window_max
    return (
        task.steps_per_revolution == other.steps_per_revolution
        and task.full_circle == other.full_circle
        and abs(task.scan_rate / other.scan_rate - 1.0) <= SAME_RATE
        and all(abs(wrapped(end)) <= SAME_STEPS * step for end in ends)
    )

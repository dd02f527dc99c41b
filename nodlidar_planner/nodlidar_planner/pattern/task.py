"""The task: an object to find, the region to search and the lidar; the region's cells."""

from dataclasses import dataclass
import math
from typing import TypeVar

from nodlidar_common.arrays import Array, Integers, Mask
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, parameter
from nodlidar_common.rounding import rounded_up
import numpy as np

Angle = TypeVar('Angle', float, Array)

# Azimuth of step 0 unless stated, for every N_L: 3/8 of a revolution to the right of straight
# ahead, as on the URG-04LX. The seam of a full circle is at step 0: there among its dark steps.
AZIMUTH_OF_STEP_0 = -0.75 * math.pi
# The URG-04LX measures steps 44 to 725 of 1024, straight ahead being 384.
MEASURED_FROM, MEASURED_TO = (44 - 384) * math.tau / 1024, (725 - 384) * math.tau / 1024
STEEPEST = 1.6  # pitch of a limit [rad]
# Tolerance of a quotient for rounding: a beam on the line between two cells is in the upper one.
ON_THE_LINE = 1e-9
# A remainder above the rows, in cells, that joins the last row: no nod might ever hit it.
LEFT_OVER = 0.01


@dataclass(frozen=True, slots=True)
class Task:
    """An object to be found in a region by a nodding lidar; see each field's description.

    Raises
    ------
    ParameterError
        If a value is out of its range, or contradicts another one.
    """

    object_size: float = parameter(
        0.10, 'Diameter of the smallest object to be found', unit='m', minimum=1e-6, maximum=1e3
    )
    distance: float = parameter(
        2.0, 'Distance at which it must be found', unit='m', minimum=1e-3, maximum=1e6
    )
    pitch_min: float = parameter(
        -0.6136, 'Lower limit of nod and region', unit='rad', minimum=-STEEPEST, maximum=STEEPEST
    )
    pitch_max: float = parameter(
        0.6136, 'Upper limit of nod and region', unit='rad', minimum=-STEEPEST, maximum=STEEPEST
    )
    azimuth: float = parameter(
        -MEASURED_FROM,
        'Width of the region to either side of its centre',
        unit='rad',
        minimum=1e-6,
        maximum=math.pi,
    )
    full_circle: bool = parameter(False, 'The lidar measures all around, and so does the region')
    steps_per_revolution: int = parameter(
        1024, 'N_L: lidar steps in a revolution, dark ones included', minimum=1, maximum=65_536
    )
    scan_rate: float = parameter(
        10.0, 'Revolutions of the lidar per second', unit='Hz', minimum=0.01, maximum=2000.0
    )
    centre: float = parameter(
        0.0, 'Centre of the region; 0 is ahead', unit='rad', minimum=-math.pi, maximum=math.pi
    )
    window_min: float = parameter(
        MEASURED_FROM,
        'Azimuth of the first beam of the lidar',
        unit='rad',
        minimum=-math.tau,
        maximum=math.tau,
    )
    window_max: float = parameter(
        MEASURED_TO,
        'Azimuth of its last beam',
        unit='rad',
        minimum=-math.tau,
        maximum=2.0 * math.tau,
    )
    azimuth_of_step_0: float = parameter(
        AZIMUTH_OF_STEP_0,
        'Azimuth of its step 0, at which a full circle begins',
        unit='rad',
        minimum=-math.tau,
        maximum=math.tau,
    )
    range_max: float = parameter(
        5.6,
        'Its range, beyond which plan_scan notes that it does not see the object',
        unit='m',
        minimum=1e-3,
        maximum=1e6,
    )

    def __post_init__(self) -> None:
        check(self)
        if self.pitch_max <= self.pitch_min:
            limit = f'above pitch_min = {self.pitch_min} rad'
            raise ParameterError('pitch_max', limit, self.pitch_max)
        if self.object_size > 2.0 * self.distance:
            limit = f'at most twice the distance of {self.distance} m'
            raise ParameterError('object_size', limit, self.object_size)
        if self.window_max < self.window_min:
            limit = f'at least window_min = {self.window_min} rad'
            raise ParameterError('window_max', limit, self.window_max)

    @property
    def span(self) -> float:
        """Pitch from limit to limit [rad]."""
        return self.pitch_max - self.pitch_min

    @property
    def beam_period(self) -> float:
        """T_s, the time from one step of the lidar to the next [s]."""
        return 1.0 / (self.scan_rate * self.steps_per_revolution)

    @property
    def cell(self) -> float:
        """Side of a cell [rad]: the angle that the object subtends at the distance."""
        return 2.0 * math.asin(self.object_size / (2.0 * self.distance))

    @property
    def columns(self) -> int:
        """Number of columns; the last may be narrower than a cell.

        It may be less than a step wider: a remainder without a step joins it.
        """
        width = math.tau if self.full_circle else 2.0 * self.azimuth
        columns, step = _cells_in(width, self.cell), math.tau / self.steps_per_revolution
        if self.full_circle:
            beyond_last = step
        elif self.azimuth > math.pi - 1e-9:  # the step opposite the centre may be the first one
            beyond_last = self.azimuth - float(self.from_centre().max())
        else:
            beyond_last = (self.centre + self.azimuth - self.azimuth_of_step_0 + 1e-9) % step
        last_step = math.floor((width - beyond_last) / self.cell + ON_THE_LINE)
        left_over = 0 <= last_step == columns - 2 and self.cell >= step
        return columns - 1 if left_over else columns

    @property
    def rows(self) -> int:
        """Number of rows; the last may be lower than a cell, or up to LEFT_OVER higher."""
        return _cells_in(self.span, self.cell, LEFT_OVER)

    @property
    def last_row(self) -> float:
        """Height of the last row [cells]."""
        return self.span / self.cell - (self.rows - 1)

    @property
    def cells(self) -> int:
        """Number of cells."""
        return self.columns * self.rows

    def step_azimuth(self) -> Array:
        """Return the azimuth of every step [rad], shape (N_L,)."""
        step = np.arange(self.steps_per_revolution, dtype=np.float64)
        return self.azimuth_of_step_0 + step * (math.tau / self.steps_per_revolution)

    def step_at(self, azimuth: Array | float) -> Integers:
        """Return the step nearest to each azimuth [rad]; same shape."""
        since = np.asarray(azimuth) - self.azimuth_of_step_0
        step = since * (self.steps_per_revolution / math.tau)
        return np.asarray(np.rint(step).astype(np.int64) % self.steps_per_revolution)

    def column_of_step(self) -> Integers:
        """Return the column that contains each step's beam, shape (N_L,); -1 outside the region.

        The region includes both its ends.
        """
        if self.full_circle:
            since_step_0 = self.step_azimuth() - self.azimuth_of_step_0
            return _cell_of(since_step_0, self.cell, self.columns)
        azimuth = self.from_centre()
        inside = self._measured() & (np.abs(azimuth) < self.azimuth + 1e-9)
        column = _cell_of(azimuth + self.azimuth, self.cell, self.columns)
        return np.where(inside, column, -1)

    def from_centre(self) -> Array:
        """Return the azimuth of every step from the centre of the region, shape (N_L,) [rad].

        A step opposite the centre is at -pi if the next step is measured, else at pi.
        """
        azimuth = wrapped(self.step_azimuth() - self.centre)
        end = np.where(np.roll(self._measured(), -1), -math.pi, math.pi)
        return np.where(np.abs(azimuth) > math.pi - 1e-9, end, azimuth)

    def _measured(self) -> Mask:
        """Return whether each step is in the window, shape (N_L,)."""
        into_window = (self.step_azimuth() - self.window_min + 1e-9) % math.tau
        return into_window < self.window_max - self.window_min + 2e-9

    def row_of_height(self, height: Array, samples_per_sweep: int) -> Integers:
        """Return the row at each height above the lower limit [samples], shape (n,).

        Heights below the first row or above the last are assigned to that row.
        """
        return _cell_of(height, self.row_height(samples_per_sweep), self.rows)

    def row_height(self, samples_per_sweep: int) -> float:
        """Return the height of a row [samples]: N_s * cell / span."""
        return samples_per_sweep * self.cell / self.span

    def speed(self, samples_per_sweep: int) -> float:
        """Return the nod's speed [rad/s]: span / (N_s T_s)."""
        return self.span / (samples_per_sweep * self.beam_period)


def wrapped(azimuth: Angle) -> Angle:
    """Return azimuths [rad], of any shape, in [-pi, pi)."""
    # Twice: the remainder of a number just below 0 is rounded to tau.
    return (azimuth + math.pi) % math.tau % math.tau - math.pi


def no_less_than(step: float, distance: float) -> str:
    """Return in words how large an object at a distance [m] is of the width of a step [rad]."""
    least = rounded_up(size_of(step, distance))
    return f'at least {least} m, a step of the lidar at {distance:g} m'


def size_of(angle: float, distance: float) -> float:
    """Return the size of an object [m] that subtends an angle [rad] at a distance [m]."""
    return 2.0 * distance * math.sin(min(angle, math.pi) / 2.0)


def column_runs(column_of_step: Integers) -> tuple[Integers, Integers]:
    """Return first step and number of steps of each measured column, in order, (columns,).

    The first step of a column that contains step 0 and the steps before it is negative: the lidar
    is in that column at sample 0.
    """
    begins = np.flatnonzero(column_of_step != np.roll(column_of_step, 1))
    if len(begins) == 0:
        begins = np.zeros(1, dtype=np.int64)
    widths = np.diff(begins, append=begins[0] + len(column_of_step))
    column = column_of_step[begins]
    begins = np.where(begins + widths > len(column_of_step), begins - len(column_of_step), begins)
    order = np.argsort(column, kind='stable')
    order = order[column[order] >= 0]
    return begins[order], widths[order]


def _cells_in(extent: float, cell: float, left_over: float = ON_THE_LINE) -> int:
    return max(1, math.ceil(extent / cell - left_over))


def _cell_of(offset: Array, cell: float, count: int) -> Integers:
    index: Integers = np.floor(offset / cell + ON_THE_LINE).astype(np.int64)
    return np.clip(index, 0, count - 1)

"""Observed coverage for the lidar that sends the scans."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.control.lidar_view import LidarView
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_assembler.control.observed_coverage import (
    Covered,
    MAX_FINEST_CELLS,
    ObservedCoverage,
)
from nodlidar_common.parameters import parameter
from nodlidar_common.time_order import TIME_JUMP_NS
import numpy as np


@dataclass(frozen=True)
class CoverageConfig(NodConfig):
    """Observed coverage."""

    coverage_window: float = parameter(
        10.0,
        'Time over which observed coverage is computed for ~/coverage and /diagnostics; with 0 it '
        'is not computed',
        unit='s',
        minimum=0.0,
        maximum=600.0,
    )


class CoverageMonitor:
    """Keeps observed coverage up to date, scan by scan.

    It begins anew when time goes back, and with another lidar.

    Parameters
    ----------
    config
        Planned nod and cells; its coverage_window is above 0.
    """

    def __init__(self, config: CoverageConfig) -> None:
        self._window, self._view = config.coverage_window, LidarView(config)
        self.restart()

    def restart(self) -> None:
        """Forget all scans."""
        nod, task = self._view.config, self._view.task
        rows = min(nod.samples_per_sweep, MAX_FINEST_CELLS // nod.steps_per_revolution)
        self._coverage = ObservedCoverage(task, rows, self._window)
        self._last_ns = 0

    def reconfigure(self, config: CoverageConfig) -> None:
        """Begin anew for another planned nod."""
        self._view.reconfigure(config)
        self.restart()

    def add(self, assembled: Assembled) -> None:
        """Add a scan."""
        scan, beams = assembled.scan, assembled.beams
        if self._view.look(beams.geometry) or self._last_ns - scan.stamp_ns > TIME_JUMP_NS:
            self.restart()
        # Scans may arrive twice or out of order, and estimated stamps be slightly early.
        times_ns = np.maximum(scan.stamp_ns + beams.offset_ns, self._last_ns)
        self._coverage.add(times_ns, beams.azimuth, assembled.pitch)
        self._last_ns = max(scan.end_ns, self._last_ns)

    def covered(self) -> Covered:
        """Return the observed coverage of the window of time up to the last scan."""
        return self._coverage.covered()

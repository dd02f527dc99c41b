"""Scans of the simulator in, coverage out: as the node does it, in virtual time."""

from dataclasses import replace

from assembling import assembled_of
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.coverage_monitor import CoverageMonitor
from test_adaptive_limits import BEAMS, scans_of_a_wall


def add(monitor, scan, pitch):
    monitor.add(assembled_of(scan, BEAMS, pitch))


def test_a_nod_covers_its_part_of_the_region():
    monitor = CoverageMonitor(AssemblerConfig(samples_per_sweep=4001))
    for scan, pitch in scans_of_a_wall(3.0):
        add(monitor, scan, pitch)
    covered = monitor.covered()
    assert covered.beams == 30 * 682
    # The nod keeps off the outer third of the region.
    assert 0.5 < covered.seen < 2.0 / 3.0 + 0.05


def test_when_time_goes_back_everything_starts_anew():
    monitor = CoverageMonitor(AssemblerConfig())
    for scan, pitch in scans_of_a_wall(3.0) + scans_of_a_wall(1.0):
        add(monitor, scan, pitch)
    assert monitor.covered().beams == 10 * 682


def test_a_scan_that_begins_just_before_the_last_ones_end_is_kept():
    monitor = CoverageMonitor(AssemblerConfig())
    [(scan, pitch)] = scans_of_a_wall(0.1)
    add(monitor, scan, pitch)
    closely = replace(scan, stamp_ns=scan.end_ns - 1000)
    add(monitor, closely, pitch)
    assert monitor.covered().beams == 2 * 682

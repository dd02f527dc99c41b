"""Odometry whose stamps are late: how far the map is off, and what map_bag makes of it.

The drives are those of `mapping` through the building. The delay that is found is taken out, as by
odometry_delay, and the drive mapped again, until what is left is too small to be named.
"""

from dataclasses import replace

from nodlidar_assembler.bags.sensor_log import clouds_in
from nodlidar_common.stamps import NS_PER_S
from nodlidar_demo.simulated_log import simulated_log, simulated_odometry
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.offline import estimates
from nodlidar_mapper.tracking.odometry_delay import is_worth_setting, odometry_delay
from nodlidar_sim.simulation import Recording
import numpy as np

from bench.maps.drives import CONFIG, errors, recorded, scene_of, true_poses
from bench.shared.report import Row

TITLE = 'Odometry that is late, through the building; and with the delay that map_bag names'
DELAYS = (0.0, 0.05, 0.1, 0.2)  # s
FASTER = (1.0, 2.0)  # than the route, which turns at 0.8 rad/s
MOST_MAPS = 5


def results() -> list[Row]:
    """Return the errors of each drive, as it is and with the delay taken out."""
    return [row for faster in FASTER for row in _rows(faster)]


def _rows(faster: float) -> list[Row]:
    scene = scene_of('building', None, faster, ideal=False)
    recording = recorded(scene, sum(leg.duration for leg in scene.base_legs), seed=1)
    turns = max(abs(leg.velocity[1]) for leg in scene.base_legs)
    return [{'turns [rad/s]': turns, **_row(recording, delay)} for delay in DELAYS]


def _row(recording: Recording, delay: float) -> Row:
    first = last = _mapped(recording, delay)
    named: list[float] = []
    while first[2] is not None and last[2] is not None and len(named) < MOST_MAPS:
        named.append(sum(named[-1:]) + last[2])
        last = _mapped(recording, delay - named[-1])
    return {
        'late [ms]': 1e3 * delay,
        'error, largest [m]': first[0],
        'clouds not matched': first[1],
        'delay named by map_bag [ms]': ', '.join(f'{1e3 * each:.0f}' for each in named) or 'none',
        'error with it [m]': last[0],
        'not matched': last[1],
    }


def _mapped(recording: Recording, late: float) -> tuple[float, int, float | None]:
    """Return the largest error [m], the clouds not matched, and the delay that is named [s]."""
    stamps_ns = recording.odometry_stamp_ns + round(late * NS_PER_S)
    odometry = simulated_odometry(replace(recording, odometry_stamp_ns=stamps_ns))
    log = replace(simulated_log(recording), odometry=odometry)
    mapper, clouds = Mapper(MapConfig()), clouds_in(log, CONFIG)[0]
    found = estimates(mapper, clouds, log)
    matched = np.array([not each.lost for each in found])
    truth = true_poses(recording, np.array([each.stamp_ns for each in found]))
    delay, error = odometry_delay(clouds, odometry, CONFIG)
    off = errors(truth, list(mapper.poses_of(found))).max()
    named = delay if is_worth_setting(delay, error) else None
    return float(off), int(np.count_nonzero(~matched[1:])), named

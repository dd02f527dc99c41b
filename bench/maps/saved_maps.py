"""A robot that begins anywhere in a saved map: whether it is found, and where.

The map is of one drive, and the robot drives the same way again, with other noise and with
odometry that began elsewhere, from a random instant on. Half a map has the first half of the
keyframes: the robot often begins where it does not reach, in rooms that look like those of it.
"""

from dataclasses import dataclass, replace

from nodlidar_assembler.bags.sensor_log import clouds_in, SensorLog
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
from nodlidar_demo.simulated_log import simulated_drive
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import inverse
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.graph.pose_graph import Edge
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.offline import estimates
from nodlidar_sim.world.planar import compose
from nodlidar_sim.world.scene import Scene
import numpy as np

from bench.maps.drawn_buildings import drawn
from bench.maps.drives import CONFIG, recorded, scene_of, true_poses
from bench.maps.equal_rooms import equal_rooms
from bench.maps.odometry_jumps import RIGHT, SPEED
from bench.shared.report import Row

TITLE = 'A robot that begins anywhere in a saved map: whether it is found, and where'
TRIALS = 10  # in each map
CLOUDS = 40  # of each trial
ELSEWHERE = np.array([-7.0, 3.0, 2.0])  # where odometry began, from where the map did [m], [rad]


@dataclass(frozen=True)
class _Drive:
    """A drive, as the mapper takes it."""

    log: SensorLog
    clouds: list[Points]
    truth: Array  # of the clouds, shape (n, 4, 4)


@dataclass(frozen=True)
class _Saved:
    """A map, and the true pose of its frame."""

    keyframes: list[Keyframe]
    edges: list[Edge]
    frame: Array


def results() -> list[Row]:
    """Return the outcomes in each map."""
    rows: list[Row] = []
    for name, (mapped, driven) in drives().items():
        whole, drive = _saved(_drive(mapped, 1, np.zeros(3))), _drive(driven, 2, ELSEWHERE)
        for extent, saved in (('whole', whole), ('half', _half(whole))):
            rows.append({'building': name, 'map': extent, **_outcomes(saved, drive)})
    return rows


def drives() -> dict[str, tuple[Scene, Scene]]:
    """Return the drives that maps are made from, and those of the robot, by name."""
    rooms = equal_rooms(1, SPEED)
    building = scene_of('building', None, 1.0, ideal=False)
    crooked, ring = (drawn(kind, 1, SPEED) for kind in ('crooked ring', 'ring'))
    return {
        'building': (building, building),
        'ring': (ring, ring),
        'crooked ring': (crooked, crooked),
        'equal rooms': (rooms, rooms),
        'equal rooms, other furniture': (rooms, equal_rooms(1, SPEED, furniture=1)),
    }


def _drive(scene: Scene, seed: int, begin: Array) -> _Drive:
    """Return a drive whose odometry begins at another pose, x, y and yaw."""
    recording = recorded(scene, sum(leg.duration for leg in scene.base_legs), seed)
    odometry = compose(begin[None], recording.odometry_pose)
    log = simulated_drive(replace(recording, odometry_pose=odometry))
    clouds = clouds_in(log, CONFIG)[0]
    stamps_ns = np.array([cloud.stamp_ns for cloud in clouds])
    return _Drive(log, clouds, true_poses(recording, stamps_ns))


def _saved(drive: _Drive) -> _Saved:
    mapper = Mapper(MapConfig())
    first = estimates(mapper, drive.clouds, drive.log)[0]
    return _Saved(mapper.map.keyframes, mapper.map.edges, drive.truth[0] @ inverse(first.pose))


def _half(whole: _Saved) -> _Saved:
    """Return the first half of a map."""
    count = len(whole.keyframes) // 2
    edges = [edge for edge in whole.edges if max(edge.start, edge.end) < count]
    return _Saved(whole.keyframes[:count], edges, whole.frame)


def _outcomes(saved: _Saved, drive: _Drive) -> Row:
    """Return how trials end, and the clouds until the robot is found."""
    rng = np.random.default_rng(1)
    ends: list[str] = []
    until: list[float] = []
    for begin in rng.integers(0, len(drive.clouds) - CLOUDS, TRIALS).tolist():
        part = slice(begin, begin + CLOUDS)
        mapper = Mapper(MapConfig(), saved.keyframes, saved.edges)
        found = estimates(mapper, drive.clouds[part], drive.log)
        poses = saved.frame @ np.stack([each.pose for each in found])
        off = np.linalg.norm((poses - drive.truth[part])[:, :2, 3], axis=1)
        lost = np.array([bool(each.lost) for each in found])
        ends.append('lost' if lost[-1] else 'wrong' if off[-1] > RIGHT else 'right')
        if ends[-1] == 'right':
            first = int(np.flatnonzero(np.append(True, lost | (off > RIGHT)))[-1])
            until.append((found[first].stamp_ns - found[0].stamp_ns) / NS_PER_S)
    return {
        'trials': TRIALS,
        **{end: ends.count(end) for end in ('right', 'lost', 'wrong')},
        'found after, median [s]': float(np.median(until)) if until else None,
        'found after, largest [s]': max(until) if until else None,
    }

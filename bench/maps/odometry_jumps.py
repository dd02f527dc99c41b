"""Drives on which odometry jumps once: whether the mapper notices, and finds the robot again.

The drives are those of `mapping` through the building and of `drawn_buildings` through a hall and
a crooked ring. The jump comes at a random place and has a random direction.
"""

from dataclasses import dataclass, replace

from nodlidar_assembler.bags.sensor_log import clouds_in
from nodlidar_common.arrays import Array, Mask, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_demo.simulated_log import simulated_drive
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.offline import estimates
from nodlidar_sim.simulation import Recording
from nodlidar_sim.world.planar import compose, relative
from nodlidar_sim.world.scene import Scene
import numpy as np

from bench.maps.drawn_buildings import drawn
from bench.maps.drives import CONFIG, errors, recorded, scene_of, true_poses
from bench.shared.report import Row

TITLE = 'One jump of odometry on a drive: where the robot is taken to be afterwards'
SPEED = 0.6  # m/s
JUMPS = ((0.3, 0.1), (1.0, 0.5), (3.0, np.pi))  # distance [m] and largest turn [rad]
TRIALS = 5  # of each jump on each drive
RIGHT = 0.3  # m off, at most
EARLIEST, LATEST = 0.3, 0.8  # share of the drive


@dataclass(frozen=True, slots=True)
class Trial:
    """What came of wrong odometry.

    Attributes
    ----------
    end
        'right', 'wrong' or 'lost', at the end of the drive.
    seconds
        From its begin until the pose was right for good [s]; NaN if it was not.
    lost
        Clouds that say that the robot is lost.
    unnoticed
        Clouds with a wrong pose without saying that the robot is lost.
    largest
        Error of those that do not say so [m].
    """

    end: str
    seconds: float
    lost: int
    unnoticed: int
    largest: float


def results() -> list[Row]:
    """Return the outcomes of each jump on each drive."""
    rng = np.random.default_rng(1)
    rows: list[Row] = []
    for name, scene in drives().items():
        recording = recorded(scene, sum(leg.duration for leg in scene.base_legs), seed=1)
        for distance, turn in JUMPS:
            trials = [_jumped(recording, distance, turn, rng) for _ in range(TRIALS)]
            ends = [trial.end for trial in trials]
            rows.append(
                {
                    'drive': name,
                    'jump [m]': distance,
                    'turn up to [rad]': turn,
                    'trials': len(trials),
                    **{end: ends.count(end) for end in ('right', 'lost', 'wrong')},
                    'right after, median [s]': float(
                        np.median([t.seconds for t in trials if t.end == 'right'])
                    ),
                    'wrong clouds unnoticed, mean': float(np.mean([t.unnoticed for t in trials])),
                }
            )
    return rows


def drives() -> dict[str, Scene]:
    """Return the drives by name."""
    return {
        'building': scene_of('building', None, 1.0, ideal=False),
        'hall': drawn('hall', 1, SPEED),
        'crooked ring': drawn('crooked ring', 1, SPEED),
    }


def _jumped(recording: Recording, distance: float, turn: float, rng: np.random.Generator) -> Trial:
    jump_ns = instant(recording, rng)
    direction = rng.uniform(-np.pi, np.pi)
    jump = np.array(
        [distance * np.cos(direction), distance * np.sin(direction), rng.uniform(-turn, turn)]
    )
    return trial(recording, with_jump(recording, jump_ns, jump), jump_ns)


def instant(recording: Recording, rng: np.random.Generator) -> int:
    """Return a random instant of a drive [ns], after its begin and well before its end."""
    begin, end = recording.odometry_stamp_ns[[0, -1]]
    return int(begin + rng.uniform(EARLIEST, LATEST) * (end - begin))


def trial(recording: Recording, wrong: Recording, begin_ns: int) -> Trial:
    """Map a drive whose odometry is wrong from an instant on [ns]; judge it by the truth."""
    log = simulated_drive(wrong)
    found = estimates(Mapper(MapConfig()), clouds_in(log, CONFIG)[0], log)
    stamps_ns = np.array([each.stamp_ns for each in found])
    off = errors(true_poses(recording, stamps_ns), [each.pose for each in found])
    return judged(off, np.array([bool(each.lost) for each in found]), stamps_ns, begin_ns)


def with_jump(recording: Recording, jump_ns: int, jump: Array) -> Recording:
    """Return a recording whose odometry goes on from another pose after an instant [ns].

    Parameters
    ----------
    recording, jump_ns
        Recording; instant of the jump [ns].
    jump
        x, y [m] and yaw [rad] of the robot after the jump, in its frame before, shape (3,).
    """
    poses = recording.odometry_pose
    after = recording.odometry_stamp_ns > jump_ns
    last = poses[~after][-1:]
    there = compose(last, jump[None])
    way = relative(last, poses[after])
    jumped = poses.copy()
    jumped[after] = compose(there, way)
    return replace(recording, odometry_pose=jumped)


def judged(off: Array, lost: Mask, stamps_ns: Times, begin_ns: int) -> Trial:
    """Judge clouds (n,) by how far they are off [m] and whether the mapper said lost."""
    wrong, after = off > RIGHT, stamps_ns > begin_ns
    end = 'lost' if lost[-1] else 'wrong' if wrong[-1] else 'right'
    bad = np.flatnonzero((wrong | lost) & after)
    seconds = (stamps_ns[bad[-1]] - begin_ns) / NS_PER_S if len(bad) else 0.0
    return Trial(
        end,
        float(seconds) if end == 'right' else float('nan'),
        int(np.count_nonzero(lost & after)),
        int(np.count_nonzero(wrong & ~lost & after)),
        float(off[~lost & after].max(initial=0.0)),
    )

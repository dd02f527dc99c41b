"""Drives on which odometry counts wrong for a while: where the robot is taken to be meanwhile.

The drives are those of `odometry_jumps`. From a random instant on, ways and turns count so many
times, as those of wheels that slip or do not grip.
"""

from dataclasses import replace

from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.simulation import Recording
from nodlidar_sim.world.planar import compose, relative
import numpy as np

from bench.maps.drives import recorded
from bench.maps.odometry_jumps import drives, instant, Trial, trial
from bench.shared.report import Row

TITLE = 'Odometry that counts ways and turns wrong for 10 s: where the robot is taken to be'
TIMES = (0.7, 1.3, 1.5)  # what odometry counts, as a share of the motion
SECONDS = 10.0
TRIALS = 5  # of each on each drive


def results() -> list[Row]:
    """Return the outcomes of each share on each drive."""
    rng = np.random.default_rng(1)
    rows: list[Row] = []
    for name, scene in drives().items():
        recording = recorded(scene, sum(leg.duration for leg in scene.base_legs), seed=1)
        for times in TIMES:
            trials: list[Trial] = []
            for _ in range(TRIALS):
                begin_ns = instant(recording, rng)
                wrong = counted(recording, begin_ns, SECONDS, times)
                trials.append(trial(recording, wrong, begin_ns))
            ends = [each.end for each in trials]
            rows.append(
                {
                    'drive': name,
                    'counts [times]': times,
                    'trials': len(trials),
                    **{end: ends.count(end) for end in ('right', 'lost', 'wrong')},
                    'clouds called lost, mean': float(np.mean([each.lost for each in trials])),
                    'wrong clouds unnoticed, mean': float(
                        np.mean([each.unnoticed for each in trials])
                    ),
                    'error unnoticed, largest [m]': max(each.largest for each in trials),
                }
            )
    return rows


def counted(recording: Recording, begin_ns: int, seconds: float, times: float) -> Recording:
    """Return a recording whose odometry counts motions so many times, for some seconds."""
    poses, stamps_ns = recording.odometry_pose, recording.odometry_stamp_ns
    steps = relative(poses[:-1], poses[1:])
    end_ns = begin_ns + round(seconds * NS_PER_S)
    steps[(stamps_ns[1:] > begin_ns) & (stamps_ns[1:] <= end_ns)] *= times
    wrong = [poses[:1]]
    for step in steps:
        wrong.append(compose(wrong[-1], step[None]))
    return replace(recording, odometry_pose=np.concatenate(wrong))

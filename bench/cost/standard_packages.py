"""What sensor_msgs_py and transforms3d take for the work that is done for each scan.

Where each is used: "Standard packages" in docs/tradeoffs.md. Results are compared before they are
timed. Where no ROS is installed, sensor_msgs_py is the underlay's.
"""

from array import array

from nodlidar_assembler.clouds.ego_motion import rotated
from nodlidar_assembler.clouds.pipeline import Pipeline, PipelineConfig
from nodlidar_assembler.clouds.point_layout import layout
from nodlidar_assembler.ros.cloud_message import cloud_message
from nodlidar_common.ros.messages import time_message
from nodlidar_demo.simulated_log import simulated_log
import numpy as np
from sensor_msgs.msg import PointCloud2
from transforms3d.quaternions import rotate_vector

from bench.shared.reference import simulated_room
from bench.shared.report import Row
from bench.shared.timing import Action, interleaved

TITLE = 'Standard packages: the work for one scan of 682 beams, by them and by NumPy alone'
ROUNDS = 40
BEAMS = 682


def results() -> list[Row]:
    """Return the time of each way, and its ratio to the first."""
    rows = []
    for work, ways in (('message of a cloud', _messages()), ('points turned', _turns())):
        times = [own for own, _ in interleaved(ways, ROUNDS)]
        rows += [
            {'work': work, 'by': name, 'time [us]': own * 1e6, 'times the first': own / times[0]}
            for name, own in zip(ways, times, strict=True)
        ]
    return rows


def _messages() -> dict[str, Action]:
    log = simulated_log(simulated_room(2.0))
    assembled = Pipeline(PipelineConfig()).add_scan(log.scans[5], log.sample_ns, log.sample_pitch)
    [points] = assembled.clouds
    given = cloud_message(points, 'frame')

    def by_hand() -> PointCloud2:
        message = PointCloud2(fields=given.fields, **layout(points.data))
        message.header.stamp = time_message(points.time_ns[0])
        message.header.frame_id = 'frame'
        data = array('B')
        data.frombytes(points.data.view(np.uint8).data)
        message.data = data
        return message

    _require(by_hand() == given)
    return {'by hand': by_hand, 'sensor_msgs_py': lambda: cloud_message(points, 'frame')}


def _turns() -> dict[str, Action]:
    rng = np.random.default_rng(1)
    turns = rng.normal(size=(BEAMS, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    points = rng.normal(size=(BEAMS, 3))
    wxyz = np.roll(turns, 1, axis=1)

    def one_by_one() -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return np.array([rotate_vector(p, q) for p, q in zip(points, wxyz, strict=True)])

    _require(np.allclose(one_by_one(), rotated(turns, points), atol=1e-12))
    return {
        'NumPy, all at once': lambda: rotated(turns, points),
        'transforms3d, one by one': one_by_one,
    }


def _require(equal: bool) -> None:
    if not equal:
        raise ArithmeticError('the results differ')

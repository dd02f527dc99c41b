"""Conversion of times, poses and nods to and from messages."""

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import NS_PER_S, time_ns
from nodlidar_msgs.msg import NodCommand


def time_message(nanoseconds: int) -> Time:
    """Return a time [ns] as a message.

    Raises
    ------
    ParameterError
        If the message cannot hold the time: from 2^31 s on, in 2038.
    """
    seconds, rest = divmod(int(nanoseconds), NS_PER_S)
    if not -(2**31) <= seconds < 2**31:
        raise ParameterError('time', f'from {-(2**31)} to {2**31 - 1} s', f'{seconds} s')
    return Time(sec=seconds, nanosec=rest)


def transform_message(stamp_ns: int, parent: str, child: str, pose: Pose) -> TransformStamped:
    """Return one frame's pose in another as a transform with a stamp [ns]."""
    message = TransformStamped(child_frame_id=child)
    message.header.stamp, message.header.frame_id = time_message(stamp_ns), parent
    x, y, z = pose.position.tolist()
    message.transform.translation = Vector3(x=x, y=y, z=z)
    x, y, z, w = pose.quaternion
    message.transform.rotation = Quaternion(x=x, y=y, z=z, w=w)
    return message


def nod_from_message(message: NodCommand) -> Nod:
    """Return the nod of a command; raises ParameterError if it is invalid."""
    return Nod(
        pitch_min=message.pitch_min,
        pitch_max=message.pitch_max,
        sweep_duration=message.sweep_duration,
        samples_per_sweep=message.samples_per_sweep,
        reference_time_ns=time_ns(message.reference_time),
    )


def nod_to_message(nod: Nod, issued_ns: int, frame_id: str, start_ns: int = 0) -> NodCommand:
    """Return the command of a nod that takes effect at `start_ns` [ns]."""
    message = NodCommand(
        pitch_min=nod.pitch_min,
        pitch_max=nod.pitch_max,
        sweep_duration=nod.sweep_duration,
        samples_per_sweep=nod.samples_per_sweep,
        reference_time=time_message(nod.reference_time_ns),
        start_time=time_message(start_ns),
    )
    message.header.stamp = time_message(issued_ns)
    message.header.frame_id = frame_id
    return message

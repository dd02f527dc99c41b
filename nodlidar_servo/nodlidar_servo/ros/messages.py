"""Nod commands, joint states and the nod status as ROS messages."""

from collections.abc import Callable

from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.messages import nod_from_message, time_message
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import time_ns
from nodlidar_common.tracking import Progress
from nodlidar_msgs.msg import NodCommand, NodStatus
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.nod.joint_config import JointConfig
from nodlidar_servo.nod.nod_commands import NodCommands
from sensor_msgs.msg import JointState


def take_command(
    commands: NodCommands, message: NodCommand, now_ns: int, log: Callable[[str], object]
) -> None:
    """Accept a command at a time [ns] of its clock; or refuse it, and log what is new in that."""
    received_ns = steady_ns()
    try:
        start_ns = received_ns + time_ns(message.start_time) - now_ns
        commands.accept(nod_from_message(message), received_ns, start_ns)
    except ParameterError as error:
        if commands.refuse(error):
            log(f'nod command refused: {error}')


def joint_state_template(joint_name: str) -> JointState:
    """Return a joint state of one joint, to be filled by :func:`fill_joint_state`."""
    return JointState(name=[joint_name], position=[0.0], velocity=[0.0], effort=[0.0])


def fill_joint_state(message: JointState, sample: Sample) -> None:
    """Fill a measurement in."""
    message.header.stamp = time_message(sample.stamp_ns)
    message.position[0] = sample.pitch
    message.velocity[0] = sample.velocity
    message.effort[0] = sample.load


def status_message(progress: Progress | None, now_ns: int, config: JointConfig) -> NodStatus:
    """Return the status at a time [ns]; no progress if the servo does not follow a nod."""
    message = NodStatus(
        following=progress is not None,
        pitch_lower_limit=config.pitch_lower_limit,
        pitch_upper_limit=config.pitch_upper_limit,
    )
    message.header.stamp = time_message(now_ns)
    if progress is None:
        message.phase_error = message.measured_samples_per_sweep = float('nan')
        return message
    nod, drive = progress.nod, progress.drive
    message.pitch_min, message.pitch_max = nod.pitch_min, nod.pitch_max
    message.speed = nod.speed
    message.samples_per_sweep = nod.samples_per_sweep
    message.measured_samples_per_sweep = nod.samples_per_sweep * progress.measured_ratio
    message.phase_error = progress.phase_error
    message.phase_lead = progress.lead_ns / NS_PER_S
    message.driven_speed, message.saturated = drive.speed, drive.saturated
    return message

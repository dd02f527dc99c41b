"""Joint states and the nod status as ROS messages."""

from nodlidar_common.ros.messages import time_message
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.tracking import NodProgress
from nodlidar_msgs.msg import NodStatus
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.nod.joint_config import JointConfig
from sensor_msgs.msg import JointState


def joint_state_template(joint_name: str) -> JointState:
    """Return a joint state of one joint, to be filled by :func:`fill_joint_state`."""
    return JointState(name=[joint_name], position=[0.0], velocity=[0.0], effort=[0.0])


def fill_joint_state(message: JointState, sample: Sample) -> None:
    """Fill a measurement in."""
    message.header.stamp = time_message(sample.stamp_ns)
    message.position[0] = sample.pitch
    message.velocity[0] = sample.velocity
    message.effort[0] = sample.load


def status_message(progress: NodProgress | None, now_ns: int, config: JointConfig) -> NodStatus:
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

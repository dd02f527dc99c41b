"""How well the servo follows the nod, as a message and as figures of the diagnostics."""

from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.messages import time_message
from nodlidar_msgs.msg import NodStatus
from nodlidar_servo.tracking import NodTracker


def status_message(tracker: NodTracker | None, now_ns: int) -> NodStatus:
    """Return the status at a time [ns]; without a tracker nothing is followed."""
    message = NodStatus(following=tracker is not None)
    message.header.stamp = time_message(now_ns)
    if tracker is None:
        message.phase_error = message.measured_samples_per_sweep = float('nan')
        return message
    nod, phase, drive = tracker.nod, tracker.phase, tracker.drive
    message.pitch_min, message.pitch_max = nod.pitch_min, nod.pitch_max
    message.speed = nod.speed
    message.samples_per_sweep = nod.samples_per_sweep
    message.measured_samples_per_sweep = nod.samples_per_sweep * phase.drift.measured_ratio
    message.phase_error = phase.error
    message.phase_lead = phase.lead_ns / NS_PER_S
    message.driven_speed, message.saturated = drive.speed, drive.saturated
    return message

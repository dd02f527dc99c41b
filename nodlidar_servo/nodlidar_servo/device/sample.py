"""A measurement of the servo."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Sample:
    """One measurement of the servo.

    Attributes
    ----------
    stamp_ns
        Host time at which the motor measured [ns], see :func:`.sample_time.sample_time_ns`.
    pitch, velocity
        Pitch [rad], positive up, and its rate [rad/s].
    load
        Load as a share of the maximum torque, -1 to 1, positive if it drives upwards.
    voltage, temperature
        Supply [V] and motor [deg C].
    status
        Status bits, see :func:`.replies.status_names`.
    """

    stamp_ns: int
    pitch: float
    velocity: float
    load: float
    voltage: float
    temperature: int
    status: int

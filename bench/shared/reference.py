"""The set-up that measurements share: the reference sensor in the room.

It nods as the assembler commands by default, or by `reference_nod`, that of the publication's
experiments, at pi rad/s. `real_room` is the scene as shipped: a URG-04LX-UG01 with its errors, on
an RX-24F by physics. `simulated_room` is the ideal one.
"""

from dataclasses import replace
from math import pi
from typing import Any

from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_common.nod import Nod
from nodlidar_planner.pattern.task import Task
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.sensor_model import SensorModel

START_NS = 1_700_000_000_000_000_000
SPAN = 1.2272
REFERENCE_N_S = 4001  # pi rad/s
DEFAULT_N_S = NodConfig().samples_per_sweep
BEAM_PERIOD = 0.1 / 1024
# What the publication plans for: 10 cm at 2 m, all around, 126 x 32 cells.
FULL_CIRCLE = Task(0.10, 2.0, -pi / 4, pi / 4, full_circle=True)
STANDING, DRIVING = (0.0, 0.0), (0.4, 0.5)  # speed of the base [m/s, rad/s]
REVERSAL_ERROR = 0.003  # of a typical servo, standard deviation [s]
FEEDBACK_RATE = {'fast': 16.0, 'balanced': 100.0}  # of the profiles, nodlidar_bringup/config
FAST_ADAPTER = 0.0015  # latency of an adapter whose timer is set to 1 ms [s]


def reference_nod(samples_per_sweep: int = REFERENCE_N_S) -> Nod:
    """Return the nod of the publication's experiments, with half a sample of phase."""
    return Nod(
        pitch_min=-SPAN / 2,
        pitch_max=SPAN / 2,
        sweep_duration=samples_per_sweep * BEAM_PERIOD,
        samples_per_sweep=samples_per_sweep,
        reference_time_ns=START_NS - round(0.5e9 * BEAM_PERIOD),
    )


def joints_at(rate: float) -> SensorModel:
    """Return the reference sensor with a rate of joint states [Hz], as the adapters give it.

    Above 62 Hz the adapter's latency timer is set to 1 ms, else to 16 ms.
    """
    if rate > SensorModel().joint_rate:
        return SensorModel(joint_rate=rate, joint_latency=FAST_ADAPTER)
    return SensorModel(joint_rate=rate)


def real_room(
    duration: float,
    sensor: SensorModel | None = None,
    velocity: tuple[float, float] = STANDING,
    seed: int = 0,
    samples_per_sweep: int = DEFAULT_N_S,
    **errors: Any,
) -> Recording:
    """Return a recording of the room as shipped, with the errors of lidar and servo.

    Parameters
    ----------
    duration
        In seconds.
    sensor
        By default the reference sensor.
    velocity
        Of the base, constant [m/s, rad/s].
    seed
        Of the noise.
    samples_per_sweep
        N_s of the nod, by default that of the assembler.
    **errors
        Attributes of the scene instead of its own: `lidar`, `servo`.
    """
    scene = replace(load_scene('room').with_velocity(velocity), **errors)
    nod = reference_nod(samples_per_sweep)
    return simulate(scene, nod, duration, seed, start_ns=START_NS, sensor=sensor)


def simulated_room(
    duration: float,
    sensor: SensorModel | None = None,
    velocity: tuple[float, float] = STANDING,
) -> Recording:
    """Return a recording of the room with an ideal lidar and servo, at the default N_s.

    Parameters
    ----------
    duration
        In seconds.
    sensor
        By default the reference sensor.
    velocity
        Of the base, constant [m/s, rad/s].
    """
    scene = load_scene('room', ideal=True).with_velocity(velocity)
    nod = reference_nod(DEFAULT_N_S)
    return simulate(scene, nod, duration, start_ns=START_NS, sensor=sensor)

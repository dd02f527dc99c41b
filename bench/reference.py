"""The set-up that measurements share: the reference sensor, nodding at pi rad/s in the room."""

from dataclasses import replace
from math import pi

from nodlidar_common.nod import NodTrajectory
from nodlidar_planner.pattern.task import Task
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.sensor_model import SensorModel

START_NS = 1_700_000_000_000_000_000
SPAN = 1.2272
SAMPLES_PER_SWEEP = 4001
BEAM_PERIOD = 0.1 / 1024
# What the publication plans for: 10 cm at 2 m, all around, 126 x 32 cells.
FULL_CIRCLE = Task(0.10, 2.0, -pi / 4, pi / 4, full_circle=True)
STANDING, DRIVING = (0.0, 0.0), (0.4, 0.5)  # speed of the base [m/s, rad/s]
REVERSAL_ERROR = 0.003  # of a typical servo, standard deviation [s]


def reference_nod() -> NodTrajectory:
    """Return the nod of the publication's experiments, with half a sample of phase."""
    return NodTrajectory(
        pitch_min=-SPAN / 2,
        pitch_max=SPAN / 2,
        sweep_duration=SAMPLES_PER_SWEEP * BEAM_PERIOD,
        samples_per_sweep=SAMPLES_PER_SWEEP,
        reference_time_ns=START_NS - round(0.5e9 * BEAM_PERIOD),
    )


def simulated_room(
    duration: float,
    reversal_error: float = 0.0,
    sensor: SensorModel | None = None,
    velocity: tuple[float, float] = STANDING,
) -> Recording:
    """Return a recording of the room.

    Parameters
    ----------
    duration
        In seconds.
    reversal_error
        White error of the instants of the reversals, standard deviation [s]; there is no other
        effect.
    sensor
        By default the reference sensor.
    velocity
        Of the base, constant [m/s, rad/s].
    """
    room = load_scene('room', ideal=True)
    effects = replace(room.effects, servo_jitter=reversal_error)
    scene = replace(room, effects=effects, base_velocity=velocity)
    return simulate(scene, reference_nod(), duration, start_ns=START_NS, sensor=sensor)

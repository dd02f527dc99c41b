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
    duration: float, servo_jitter: float = 0.0, sensor: SensorModel | None = None
) -> Recording:
    """Return a sensor's recording of the room, by default that of the reference sensor.

    It has no effects but, if asked for, errors of the instants at which the servo turns around:
    white, of a standard deviation [s].
    """
    room = load_scene('room')
    room = replace(room, effects=replace(room.effects, servo_jitter=servo_jitter))
    return simulate(room, reference_nod(), duration, start_ns=START_NS, sensor=sensor)

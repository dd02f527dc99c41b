"""Lidar and servo of a scene, of the models that can be emulated."""

from dataclasses import replace

from nodlidar_common.ldrobot import LD19
from nodlidar_sim.devices.controlled_joint import ControlledJoint
from nodlidar_sim.devices.device import Device
from nodlidar_sim.devices.driven_lidar import DrivenLidar
from nodlidar_sim.devices.other_lidars import OTHER_LIDARS
from nodlidar_sim.devices.scip_models import SCIP_MODELS
from nodlidar_sim.devices.servo_models import EMULATED, make_emulator
from nodlidar_sim.devices.streaming_lidar import StreamingLidar
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.world.device_section import load_lidar
from nodlidar_sim.world.effects import imperfect
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.lidar import Lidar
from nodlidar_sim.world.nod_motion import Motion, ServoShaft
from nodlidar_sim.world.odometry import Base
from nodlidar_sim.world.scene import Scene
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
from nodlidar_sim.world.world import World
import numpy as np

WITH_BYTES = (*SCIP_MODELS, LD19)
LIDARS = (*WITH_BYTES, *OTHER_LIDARS)
CONTROLLED = 'trajectory'
SERVOS = (*EMULATED, CONTROLLED)


def make_devices(
    scene: Scene,
    start_ns: int,
    seed: int,
    *,
    latency_timer: float = 0.0,
    scip11: bool = False,
    base: Base | None = None,
    servo_model: str = 'RX-24F',
    lidar_model: str = 'URG-04LX-UG01',
) -> dict[str, Device]:
    """Return the two devices, 'lidar' and 'servo', in a scene.

    Parameters
    ----------
    scene
        Surfaces, motion and effects.
    start_ns
        Host time of power-up, when base and objects leave their start [ns].
    seed
        Of the effects and of the phase of the lidar's rotation.
    latency_timer
        Of the servo's USB adapter [s].
    scip11
        Whether the lidar powers up in SCIP 1.1.
    base
        Motion of the base; by default the scene's route.
    servo_model, lidar_model
        One of SERVOS, and one of LIDARS.
    """
    seeds = np.random.SeedSequence(seed).generate_state(5).tolist()  # independent effects
    servo_seed, lidar_seed, range_seed, driver_seed, phase_seed = seeds
    shaft = make_servo(scene, servo_seed)
    servo: Device
    motion: Motion
    if servo_model == CONTROLLED:
        servo = motion = ControlledJoint(shaft, start_ns)
    else:
        servo, motion = make_emulator(servo_model, shaft, latency_timer), shaft
    world = World(scene, motion, base, start_ns)
    ranges = Lidar(scene.lidar, world, start_ns, lidar_seed).ranges
    measure = imperfect(ranges, scene.effects, range_seed)
    clock_rate = scene.effects.clock_rate
    lidar: Device
    if lidar_model in OTHER_LIDARS:
        lidar = DrivenLidar(
            OTHER_LIDARS[lidar_model],
            measure,
            start_ns=start_ns,
            clock_rate=clock_rate,
            seed=driver_seed,
        )
    elif lidar_model == LD19:
        lidar = StreamingLidar(measure, start_ns=start_ns, clock_rate=clock_rate, seed=driver_seed)
    else:
        lidar = UrgEmulator(
            measure,
            start_ns=start_ns,
            clock_rate=clock_rate,
            rotation_phase=np.random.default_rng(phase_seed).random(),
            scip11=scip11,
            model=SCIP_MODELS[lidar_model],
        )
    return {'lidar': lidar, 'servo': servo}


def with_ld19(scene: Scene) -> Scene:
    """Return a scene whose lidar has the errors of an LD19, if it has those of a URG."""
    is_urg = scene.lidar == load_lidar('urg_04lx_ug01')
    return replace(scene, lidar=load_lidar('ld19')) if is_urg else scene


def make_servo(scene: Scene, seed: int) -> ServoShaft:
    """Return the motion of the scene's servo, at rest at pitch 0, with a seed of its effects."""
    if scene.servo is None:
        return IdealServo(jitter=scene.effects.servo_jitter, seed=seed)
    return PhysicalServo(scene.servo, seed=seed)

"""Set-ups for the error budget, drawn at random: scenes, nods, devices, estimators, robots."""

from dataclasses import dataclass, replace

from nodlidar_common.nod import Nod
from nodlidar_planner.error_budget.parameters import ErrorParameters
from nodlidar_sim.world.device_section import load_lidar, load_servo
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.scene import load_scene, Scene
from nodlidar_sim.world.sensor_model import SensorModel
from nodlidar_sim.world.servo.parameters import ServoParameters
import numpy as np

from bench.errors.edge_scenes import drawn_room
from bench.shared.reference import BEAM_PERIOD, START_NS

SHIPPED = ('room', 'corner', 'corridor', 'crossing', 'wall')
LIDARS = ('urg_04lx_ug01', 'urg_04lx')
ESTIMATORS = ('slerp', 'trajectory')
SPEEDS = (0.5, 5.5)  # rad/s; an RX-24F holds up to 6
DRAWN = 'drawn'
DRAW = 15  # 14 served to develop the budget, and no formula changed after this one


@dataclass(frozen=True, slots=True)
class SetUp:
    """A set-up.

    Attributes
    ----------
    scene
        With its lidar, servo and robot.
    sensor, nod
        The devices' timing, and the nod.
    share
        The nearest beams that count, of all.
    lidar
        Name of its lidar.
    given
        What is known of its errors: all but the bias of the ranges, the smooth error of the
        encoder and the errors of odometry, which depend on scene, servo and robot.
    seed
        Of the simulated errors.
    """

    scene: Scene
    sensor: SensorModel
    nod: Nod
    share: float
    lidar: str
    given: ErrorParameters
    seed: int


def drawn_setup(seed: int) -> SetUp:
    """Return a random set-up; the first ones are in the shipped scenes."""
    rng = np.random.default_rng([seed, DRAW])
    scene = load_scene(SHIPPED[seed], ideal=True) if seed < len(SHIPPED) else drawn_room(seed)
    name, lidar = _lidar(rng)
    tick, noise = float(np.exp(rng.uniform(*np.log([7e-4, 6e-3])))), float(rng.uniform(0.0, 0.5))
    servo = _servo(rng, tick, noise) if rng.random() < 0.5 else None
    acceleration = 200.0 if servo else float(rng.uniform(80.0, 300.0))
    rate = float(rng.uniform(40.0, 200.0))
    sensor = SensorModel(
        joint_rate=rate, joint_latency=1.5e-3, joint_tick=tick, acceleration=acceleration
    )
    velocity = _velocity(rng)
    effects = Effects()
    if any(velocity):
        effects = Effects(
            odometry_error=float(rng.uniform(0.0, 0.03)),
            heading_drift=float(rng.uniform(0.0, 0.02)),
        )
    uncertain = float(rng.random() < 0.5)  # else delays and mount are exact
    given = ErrorParameters(
        range_noise=lidar.noise,
        range_noise_growth=lidar.noise_growth,
        estimator=str(rng.choice(ESTIMATORS)),
        joint_rate=rate,
        encoder_step=tick,
        encoder_noise=servo.encoder_noise * tick if servo else 0.0,
        backlash=servo.backlash if servo else 0.0,
        reversal_acceleration=acceleration,
        joint_delay_error=uncertain * float(rng.uniform(0.0, 1e-3)),
        scan_delay_error=uncertain * float(rng.uniform(0.0, 1e-3)),
        mount_position_error=uncertain * float(rng.uniform(0.0, 3e-3)),
        mount_angle_error=uncertain * float(rng.uniform(0.0, 4e-3)),
        robot_speed=velocity[0],
        robot_turn_rate=velocity[1],
    )
    return SetUp(
        replace(scene.with_velocity(velocity), lidar=lidar, servo=servo, effects=effects),
        sensor,
        _nod(rng),
        float(rng.uniform(0.3, 1.0)),
        name,
        given,
        seed,
    )


def _lidar(rng: np.random.Generator) -> tuple[str, LidarParameters]:
    """Return one of the two lidars, or one with errors of random size, and its name."""
    if rng.random() < 2.0 / 3.0:
        name = str(rng.choice(LIDARS))
        return name, load_lidar(name)
    drawn = LidarParameters(
        noise=float(rng.uniform(5e-4, 1e-2)),
        noise_growth=float(rng.uniform(0.0, 6e-3)),
        brightness_bias=float(rng.uniform(-0.02, 0.02)),
        incidence_bias=float(rng.uniform(-0.02, 0.02)),
        divergence=0.010,
    )
    return DRAWN, drawn


def _servo(rng: np.random.Generator, tick: float, noise: float) -> ServoParameters:
    """Return an RX-24F with another encoder and backlash."""
    backlash = float(rng.uniform(1e-3, 6e-3))
    smooth = float(rng.uniform(0.0, 3e-3)) / tick
    return replace(
        load_servo('rx24f'),
        tick=tick,
        encoder_noise=noise,
        encoder_nonlinearity=smooth,
        backlash=backlash,
    )


def _velocity(rng: np.random.Generator) -> tuple[float, float]:
    if rng.random() < 0.5:
        return 0.0, 0.0
    return float(rng.uniform(0.05, 0.4)), float(rng.uniform(0.0, 0.6))


def _nod(rng: np.random.Generator) -> Nod:
    span = float(rng.uniform(0.8, 1.4))
    speed = float(np.exp(rng.uniform(*np.log(SPEEDS))))
    samples = round(span / speed / BEAM_PERIOD)
    middle = float(rng.uniform(-0.1, 0.1))
    return Nod(middle - span / 2.0, middle + span / 2.0, samples * BEAM_PERIOD, samples, START_NS)

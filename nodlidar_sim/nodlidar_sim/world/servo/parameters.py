"""The parameters of a servo by physics; SI units, at the output of the gear."""

from __future__ import annotations

from dataclasses import dataclass
import math

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, parameter

PERIOD = 1e-3
"""Cycle of the firmware, and time from a recorded state to the next [s]."""

_STIFFEST = 0.5  # angular frequency of the contact times the step, see Plant


@dataclass(frozen=True, slots=True)
class ServoParameters:
    """A servo with its load; every effect is off at its default.

    Raises
    ------
    ParameterError
        If a value is out of its range, or the contact too stiff for the step.
    """

    supply: float = parameter(12.0, 'Voltage of the supply at rest', unit='V', minimum=0.1)
    supply_resistance: float = parameter(
        0.0, 'Resistance of supply and cable: the voltage sags', unit='ohm', minimum=0.0
    )
    kt: float = parameter(1.0, 'Torque of 1 A, also volts at 1 rad/s', unit='Nm/A', minimum=1e-3)
    resistance: float = parameter(5.0, 'Resistance of the motor, cold', unit='ohm', minimum=1e-3)
    armature: float = parameter(0.005, 'Inertia of rotor and gear', unit='kg m^2', minimum=1e-6)
    warming: float = parameter(
        0.0, 'Temperature that 1 W of lost power adds in the end', unit='K/W', minimum=0.0
    )
    warming_time: float = parameter(
        300.0, 'Time constant of the temperature', unit='s', minimum=1.0
    )
    friction_viscous: float = parameter(0.0, 'Kv of model M4', unit='Nm s/rad', minimum=0.0)
    friction_coulomb: float = parameter(0.0, 'Kc of model M4', unit='Nm', minimum=0.0)
    friction_load: float = parameter(
        0.0, 'Kl of model M4: share of the transmitted torque', minimum=0.0, maximum=1.0
    )
    stribeck_coulomb: float = parameter(0.0, 'Kcs of model M4', unit='Nm', minimum=0.0)
    stribeck_load: float = parameter(0.0, 'Kls of model M4', minimum=0.0, maximum=1.0)
    stribeck_speed: float = parameter(1.0, 'ws of model M4', unit='rad/s', minimum=1e-3)
    stribeck_exponent: float = parameter(1.0, 'a of model M4', minimum=0.1, maximum=10.0)
    p_gain: float = parameter(5.0, 'Duty by position error', unit='1/rad', minimum=0.0)
    i_gain: float = parameter(0.0, 'Duty by its integral', unit='1/(rad s)', minimum=0.0)
    d_gain: float = parameter(0.0, 'Duty by its change', unit='s/rad', minimum=0.0)
    margin: float = parameter(0.0, 'Error without effect', unit='ticks', minimum=0.0)
    punch: float = parameter(0.0, 'Least duty beyond the margin', minimum=0.0, maximum=1.0)
    torque_limit: float = parameter(1.0, 'Highest duty', minimum=0.0, maximum=1.0)
    compliance: bool = parameter(
        False, 'The registers of compliance margin, slope and punch replace gain, margin and punch'
    )
    tick: float = parameter(
        math.radians(300.0) / 1024, 'Step of the encoder', unit='rad', minimum=1e-6, maximum=0.1
    )
    encoder_noise: float = parameter(
        0.0, 'Noise of the encoder, before rounding', unit='ticks', minimum=0.0, maximum=10.0
    )
    encoder_nonlinearity: float = parameter(
        0.0, 'Largest smooth error of the encoder', unit='ticks', minimum=0.0, maximum=100.0
    )
    speed_unit: float = parameter(
        0.111 * math.tau / 60.0, 'Step of the speed register', unit='rad/s', minimum=1e-6
    )
    speed_counts: int = parameter(1023, 'Highest value of the speed register', minimum=1)
    backlash: float = parameter(
        0.0, 'Free play between encoder and lidar', unit='rad', minimum=0.0, maximum=0.1
    )
    stiffness: float = parameter(
        200.0, 'Of gear and bracket, where there is backlash', unit='Nm/rad', minimum=1.0
    )
    load_mass: float = parameter(0.16, 'Mass of the lidar', unit='kg', minimum=0.0)
    load_height: float = parameter(
        0.08, 'Centre of mass above the axis at pitch 0; negative: below', unit='m',
        minimum=-1.0, maximum=1.0,
    )  # fmt: skip
    load_inertia: float = parameter(
        1e-4, 'Inertia of the lidar about its own centre', unit='kg m^2', minimum=0.0
    )
    cable_stiffness: float = parameter(0.0, 'Spring of the cable', unit='Nm/rad', minimum=0.0)
    cable_rest: float = parameter(
        0.0,
        'Pitch at which the cable does not pull',
        unit='rad',
        minimum=-math.pi,
        maximum=math.pi,
    )
    stop: float = parameter(
        1000.0, 'Pitch up and down at which the bracket stops the shaft', unit='rad', minimum=0.1
    )
    substeps: int = parameter(2, 'Steps of the motion in 1 ms', minimum=1, maximum=100)

    def __post_init__(self) -> None:
        check(self)
        if self.backlash > 0.0 and self.contact_frequency * self.step > _STIFFEST:
            stiffest = (_STIFFEST / self.step) ** 2 * self.contact_inertia
            limit = f'at most {stiffest:.4g} Nm/rad, for {self.substeps} substeps'
            raise ParameterError('stiffness', limit, self.stiffness)

    @property
    def step(self) -> float:
        """Step of the integration [s]."""
        return PERIOD / self.substeps

    @property
    def lidar_inertia(self) -> float:
        """Inertia of the lidar about the nod axis [kg m^2]."""
        return self.load_mass * self.load_height**2 + self.load_inertia

    @property
    def contact_inertia(self) -> float:
        """Inertia of armature and lidar against each other [kg m^2]; 0 without a lidar."""
        return self.armature * self.lidar_inertia / (self.armature + self.lidar_inertia)

    @property
    def contact_frequency(self) -> float:
        """Angular frequency of armature and lidar in contact [rad/s]; infinite without a lidar."""
        inertia = self.contact_inertia
        return math.sqrt(self.stiffness / inertia) if inertia > 0.0 else math.inf

    @property
    def no_load_speed(self) -> float:
        """Speed without load and friction, at full duty [rad/s]."""
        return self.supply / self.kt

    @property
    def standstill_torque(self) -> float:
        """Torque of the motor at rest, at full duty, without sag [Nm]."""
        return self.kt * self.supply / self.resistance

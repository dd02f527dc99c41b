"""Motor, gear and lidar: their motion at a fixed step.

The motor is a DC motor behind a gear: torque = kt (u - kt w) / R, with the voltage u = duty times
supply. Friction is model M4 of Duclusaud, Passault, Padois and Ly, "Extended friction models
for the physics simulation of servo actuators" (arXiv 2410.08650): with the torque tm of the motor
and te of the load, it is at most

    Kv |w| + Kc + Kl |tm - te| + exp(-|w / ws|^a) (Kcs + Kls |tm - te|).

The scheme is the semi-implicit Euler method: velocities first, then positions with the new
velocities. The torques linear in the velocity (counter-voltage, Kv) are implicit,

    w' = (J w + h T) / (J + h (kt^2 / R + Kv)),

which is stable at any step h. The rest of the friction takes away at most what is left of w', and
so stops or slows, but never drives. The stiffest rest is the position loop, some 60 rad/s, and the
contact of a servo with backlash. An oscillator of angular frequency v is stable below h v = 2;
ServoParameters allows the contact 0.5, where its damping of CONTACT_DAMPING is also stable.
"""

from __future__ import annotations

import math

from nodlidar_sim.world.servo.parameters import ServoParameters

CONTACT_DAMPING = 0.3
"""Damping ratio of the contact between servo and lidar, of metal gears in a plastic bracket."""

COPPER = 0.0039
"""Rise of the motor's resistance by temperature [1/K]."""

GRAVITY = 9.81

Bodies = tuple[float, float, float, float]
"""Position [rad] and velocity [rad/s] of the shaft, then of the lidar."""


class Plant:
    """Moves shaft and lidar for a cycle of the firmware.

    Parameters
    ----------
    parameters
        Of the servo.

    Attributes
    ----------
    torque
        Of the motor, at the last step [Nm].
    """

    def __init__(self, parameters: ServoParameters) -> None:
        p = parameters
        self.torque = 0.0
        self._p = p
        self._step = p.step
        self._lidar_inertia = p.lidar_inertia
        self._play = p.backlash / 2.0
        self._weight = p.load_mass * GRAVITY * p.load_height
        self._rigid = p.backlash == 0.0
        self._inertia = p.armature + (p.lidar_inertia if self._rigid else 0.0)
        self._drive = self._brake = 0.0  # torque at rest and damping by the motor, in a period
        self._damping = 2.0 * CONTACT_DAMPING * math.sqrt(p.stiffness * p.contact_inertia)

    def advance(self, motion: Bodies, duty: float | None, warmth: float) -> Bodies:
        """Return the motion after a period.

        Parameters
        ----------
        motion
            Before it.
        duty
            Of the motor, -1 to 1; None without torque: its circuit is open.
        warmth
            Temperature of the motor above the surroundings [K].
        """
        move = self._as_one if self._rigid else self._with_backlash
        self._drive, self._brake = self.drive(duty, motion[1], self.resistance(warmth))
        for _ in range(self._p.substeps):
            motion = move(*motion)
        return motion if abs(motion[0]) < self._p.stop else self._stopped(motion)

    def _stopped(self, motion: Bodies) -> Bodies:
        """Return a motion beyond a stop as at rest there."""
        stop = math.copysign(self._p.stop, motion[0])
        return (stop, 0.0, stop, 0.0) if self._rigid else (stop, 0.0, *motion[2:])

    def resistance(self, warmth: float) -> float:
        """Return the resistance of the motor [ohm] at a temperature above the surroundings."""
        return self._p.resistance * (1.0 + COPPER * warmth)

    def load(self, pitch: float) -> float:
        """Return the torque of weight and cable on the lidar at a pitch [rad], in Nm."""
        p = self._p
        return self._weight * math.sin(pitch) - p.cable_stiffness * (pitch - p.cable_rest)

    def drive(self, duty: float | None, speed: float, resistance: float) -> tuple[float, float]:
        """Return the torque at rest [Nm] of a duty, and the damping by the motor [Nm s/rad].

        The supply sags by its resistance times its current, duty times that of the motor. It
        takes no current back.
        """
        if duty is None:
            return 0.0, 0.0
        p = self._p
        volts = p.supply
        if p.supply_resistance > 0.0:
            share = p.supply_resistance * duty / resistance
            volts = min(volts, (volts + share * p.kt * speed) / (1.0 + share * duty))
        return p.kt * duty * volts / resistance, p.kt * p.kt / resistance

    def _speed(self, speed: float, load: float) -> float:
        """Return the speed of the shaft after a step, under a torque of the load [Nm]."""
        p, step = self._p, self._step
        self.torque = torque = self._drive - self._brake * speed
        transmitted = abs(torque - load)
        stribeck = math.exp(-(abs(speed / p.stribeck_speed) ** p.stribeck_exponent))
        friction = (
            p.friction_coulomb
            + p.friction_load * transmitted
            + stribeck * (p.stribeck_coulomb + p.stribeck_load * transmitted)
        )
        inertia = self._inertia + step * (self._brake + p.friction_viscous)
        free = self._inertia * speed + step * (self._drive + load)
        slowed = abs(free) - step * friction
        return math.copysign(slowed / inertia, free) if slowed > 0.0 else 0.0

    def _as_one(self, shaft: float, speed: float, _: float, __: float) -> Bodies:
        speed = self._speed(speed, self.load(shaft))
        shaft += self._step * speed
        return shaft, speed, shaft, speed

    def _with_backlash(
        self, shaft: float, speed: float, lidar: float, lidar_speed: float
    ) -> Bodies:
        step = self._step
        contact = self._contact(shaft - lidar, speed - lidar_speed)
        lidar_speed += step * (self.load(lidar) + contact) / self._lidar_inertia
        speed = self._speed(speed, -contact)
        return shaft + step * speed, speed, lidar + step * lidar_speed, lidar_speed

    def _contact(self, lead: float, closing: float) -> float:
        """Return the torque of the shaft on the lidar [Nm], which pushes and never pulls.

        Parameters
        ----------
        lead, closing
            Of the shaft against the lidar [rad], [rad/s].
        """
        pressed = abs(lead) - self._play
        if pressed <= 0.0:
            return 0.0
        side = math.copysign(1.0, lead)
        return side * max(0.0, self._p.stiffness * pressed + self._damping * side * closing)

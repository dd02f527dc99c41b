"""How each servo by physics does the reference nod: its motion against the commanded triangle.

Also the fastest nod that each model is planned for. In the fast mode, commanded as by the servo
node, joint states at 100 Hz, or at 62 Hz, as with a latency timer of 16 ms. Motion is that of the
shaft, in the mean over some encoders. A reversal is where the shaft is farthest, the middle of a
leg where it is level. The nonlinearity is that of many encoders. The lidar is a URG-04LX-UG01, but
on the XL330-M077 one of 50 g. The last rows are of sets that differ: the XL330-M077 with the
former lidar, and with the motor identified for the XL330-M288, referred to its gear; then others
with the armature and friction that are guessed for the RX-64.
"""

from dataclasses import replace
from itertools import pairwise
import time
from typing import Any

from nodlidar_common.arrays import Array, Times
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_planner.pattern.nod_speeds import MAX_SPEEDS
from nodlidar_sim.devices.servo_models import EMULATED
from nodlidar_sim.nodding import nodding_servo, SETTLING
from nodlidar_sim.world.device_section import load_servo, servo_names
from nodlidar_sim.world.sensor_model import SensorModel
from nodlidar_sim.world.servo.encoder import Encoder
from nodlidar_sim.world.servo.parameters import ServoParameters
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import numpy as np

from bench.shared.reference import joints_at, reference_nod, START_NS
from bench.shared.report import Row
from bench.shared.rms import means, rms

DURATION = 30.0
EARLIEST = 0.1  # sweeps; a servo that is earlier counts as late on the leg before
ENCODERS, THINNED = range(300), 100
DRIVEN = range(4)  # encoders with which each servo is driven
SLOW = 2.0  # times the duration of a sweep
HEAVY = {'load_mass': ServoParameters().load_mass}
XL330 = load_servo('xl330')
IDENTIFIED = {'kt': XL330.kt * 77.5 / 288.4, 'resistance': XL330.resistance}
GUESSED = ['armature', *(f'friction_{each}' for each in ('viscous', 'coulomb', 'load'))]
GUESSED += [f'stribeck_{each}' for each in ('coulomb', 'load', 'speed', 'exponent')]
NODS = {'reference': 1.0, 'half as fast': SLOW}
SENSOR = joints_at(100.0)
PLANNED = {'as planned': SENSOR, 'as planned, 62 Hz': joints_at(62.0)}
TITLE = (
    f'Servos by physics on the reference nod (span 1.2272 rad, pi rad/s) and on one at 1/{SLOW:g} '
    f'of its speed, {DURATION:.0f} s, joint states at 100 Hz; as planned: the fastest of the model'
)


def results() -> list[Row]:
    """Return a row for each set of parameters, at the reference speed, slower and as planned."""
    rows = [
        _row(name, nod, nod_of(slower), SENSOR)
        for nod, slower in NODS.items()
        for name in servo_names()
    ]
    fastest = {kind.parameters: MAX_SPEEDS[model] for model, kind in EMULATED.items()}
    for title, sensor in PLANNED.items():
        for name, speed in sorted(fastest.items()):
            rows.append(_row(name, title, nod_of(reference_nod().speed / speed), sensor))
    slow = nod_of(SLOW)
    rows.append(_row('xl330_m077', 'half as fast, 0.16 kg', slow, SENSOR, **HEAVY))
    rows.append(_row('xl330_m077', 'half as fast, identified motor', slow, SENSOR, **IDENTIFIED))
    guesses = {key: getattr(load_servo('rx64'), key) for key in GUESSED}
    for name in ('ax12a', 'ax18a', 'rx28'):
        nod = nod_of(reference_nod().speed / fastest[name])
        rows.append(_row(name, 'as planned, guesses of rx64', nod, SENSOR, **guesses))
    return rows


def nod_of(slower: float) -> Nod:
    """Return the reference nod, slower by a factor."""
    nod = reference_nod()
    return Nod(
        nod.pitch_min,
        nod.pitch_max,
        nod.sweep_duration * slower,
        round(nod.samples_per_sweep * slower),
        nod.reference_time_ns,
    )


def _row(name: str, nod_name: str, nod: Nod, sensor: SensorModel, **changes: Any) -> Row:
    parameters = replace(load_servo(name), **changes)
    end_ns = START_NS + round(DURATION * NS_PER_S)
    times_ns = np.arange(START_NS, end_ns, NS_PER_S // 1000)
    taken, motions = [], []
    for seed in DRIVEN:
        begin = time.process_time()
        servo = nodding_servo(parameters, nod, sensor, START_NS, end_ns, seed=seed)
        taken.append(time.process_time() - begin)
        motions.append(motion_figures(servo, nod, times_ns))
    lidar, shaft = servo.position(times_ns), servo.shaft_position(times_ns)
    backlash, nonlinearity = lidar - shaft, _nonlinearity(parameters, shaft)
    return {
        'servo': name,
        'nod': nod_name,
        'speed [rad/s]': nod.speed,
        'no-load speed [rad/s]': parameters.no_load_speed,
        'standstill torque [Nm]': parameters.standstill_torque,
        **means(motions),
        'backlash, RMS [mrad]': rms(backlash) * 1e3,
        'nonlinearity, RMS [mrad]': rms(nonlinearity) * 1e3,
        'both, RMS [mrad]': rms(backlash[::THINNED] - nonlinearity) * 1e3,
        'times real time': (DURATION + SETTLING) / float(np.mean(taken)),
    }


def _nonlinearity(parameters: ServoParameters, shaft: Array) -> Array:
    """Return the smooth errors [rad] of many encoders, at every THINNED-th position."""
    thinned = shaft[::THINNED]
    return np.stack([Encoder(parameters, seed).smooth(thinned) - thinned for seed in ENCODERS])


def motion_figures(servo: PhysicalServo, nod: Nod, times_ns: Times) -> Row:
    """Return how the shaft's motion differs from the commanded nod at times 1 ms apart."""
    pitch = servo.shaft_position(times_ns)
    extremes, reversals, middles = _legs(pitch, nod.sweeps(times_ns))
    return {
        'RMS deviation from the triangle [mrad]': rms(pitch - nod.pitch(times_ns)) * 1e3,
        'limits reached [share]': float(np.mean(extremes)) / (nod.span / 2.0),
        'reversals late by [ms]': float(np.mean(reversals)) * nod.sweep_duration * 1e3,
        'scatter of the reversals [ms]': float(np.std(reversals)) * nod.sweep_duration * 1e3,
        'middles late by [ms]': float(np.mean(middles)) * nod.sweep_duration * 1e3,
        'scatter of the middles [ms]': float(np.std(middles)) * nod.sweep_duration * 1e3,
    }


def _legs(pitch: Array, sweeps: Array) -> tuple[Array, Array, Array]:
    """Return the extremes [rad], and how late they and the middles of the legs are [sweeps]."""
    level = np.flatnonzero(np.signbit(pitch[:-1]) != np.signbit(pitch[1:]))
    share = pitch[level] / (pitch[level] - pitch[level + 1])
    middles = sweeps[level] + share * (sweeps[level + 1] - sweeps[level])
    legs = np.floor(middles - 0.5 + EARLIEST)
    farthest = np.array(
        [
            begin + 1 + int(np.argmax(np.abs(pitch[begin + 1 : end + 1])))
            for begin, end in pairwise(level)
        ]
    )
    before, most, after = (np.abs(pitch[farthest + step]) for step in (-1, 0, 1))
    bend = np.minimum(before - 2.0 * most + after, -1e-12)
    peak = 0.5 * (before - after) / bend  # of the parabola through them
    reversals = sweeps[farthest] + peak * (sweeps[1] - sweeps[0])
    return most, reversals - legs[:-1] - 1.0, middles - legs - 0.5

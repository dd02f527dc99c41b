"""How well the nod keeps its phase to the lidar: the servo with all its faults, for two minutes.

In virtual time: the servo at byte level, with its tick, its speed register and an adapter that
holds replies back. One servo is ideal but for reversing late, weaker and slower than commanded;
the other is an RX-24F by physics. The stamps of the scans jitter, and the lidar's clock is off.
Reversals and middles of the legs are those of the shaft's true motion.
"""

from collections.abc import Callable
import math

from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.devices.rx_motor import TICK
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.servo.parameters import ServoParameters
import numpy as np

from bench.nod.servo_rig import (
    Faults,
    LATENCY_TIMER,
    LIDAR_PPM,
    LOADED,
    Rig,
    SETTLING,
    SHORT_LATENCY_TIMER,
    Tied,
    TRUE_BEAM_NS,
)
from bench.shared.reference import DEFAULT_N_S, SPAN, START_NS
from bench.shared.report import Row
from bench.shared.rms import means, rms

DURATION = 120.0
SEEDS = range(4)  # of the servos; figures are means over them
NOMINAL_SPEED = SPAN / (DEFAULT_N_S * 0.1 / 1024)


def locked(rig: Rig) -> Callable[[], object]:
    """Return a cycle of the servo that follows a nod tied to the lidar."""
    return Tied(rig, seed=1, samples_per_sweep=DEFAULT_N_S).cycle


def by_speed_commands(rig: Rig) -> Callable[[], object]:
    """Return a cycle at the nominal speed that reverses about where the limit is measured."""
    goal = SPAN / 2

    def cycle() -> None:
        nonlocal goal
        sample = rig.servo.read()
        if (goal - sample.pitch) * math.copysign(1.0, goal) <= 1.5 * TICK:
            goal = -goal
        rig.servo.drive(goal, NOMINAL_SPEED)

    return cycle


NODS = {'phase locked': locked, 'speed commands only': by_speed_commands}
RX24F = load_servo('rx24f')
LOOPS: list[tuple[str, str, Faults | ServoParameters, float]] = [
    ('phase locked', 'late, loaded', LOADED, LATENCY_TIMER),
    ('phase locked', 'RX-24F by physics', RX24F, LATENCY_TIMER),
    ('phase locked', 'RX-24F by physics', RX24F, SHORT_LATENCY_TIMER),
    ('speed commands only', 'late, loaded', LOADED, LATENCY_TIMER),
    ('speed commands only', 'RX-24F by physics', RX24F, LATENCY_TIMER),
]
TITLE = (
    f'Phase of the nod to the lidar, {DURATION:.0f} s at N_s = {DEFAULT_N_S}, '
    f'lidar {LIDAR_PPM:.0f} ppm off'
)


def results() -> list[Row]:
    """Return the figures of nods that are locked, or have speed commands only."""
    return [
        {'nod': nod, 'servo': name, 'joint states [Hz]': 62 if timer == LATENCY_TIMER else 100}
        | means([figures(locked_rig(nod, servo, timer, seed)) for seed in SEEDS])
        for nod, name, servo, timer in LOOPS
    ]


def locked_rig(nod: str, servo: Faults | ServoParameters, latency_timer: float, seed: int) -> Rig:
    """Return a rig after DURATION of a nod."""
    rig = Rig(servo, seed=seed, latency_timer=latency_timer)
    rig.run(NODS[nod](rig), START_NS + round((SETTLING + DURATION) * NS_PER_S))
    return rig


def figures(rig: Rig) -> Row:
    """Return N_s, by a line through the reversals, and how late reversals and middles are."""
    reversals_ns = rig.reversals_ns()
    beams = (reversals_ns - START_NS) / TRUE_BEAM_NS
    error = _lateness(reversals_ns, 0.0)
    early, late = reversals_ns - reversals_ns[0] < 60e9, reversals_ns[-1] - reversals_ns < 60e9
    slope = float(np.polyfit(np.arange(len(beams)), beams, 1)[0])
    return {
        f'measured N_s, less {DEFAULT_N_S}': slope - DEFAULT_N_S,
        'reversals late, RMS of the first minute [ms]': rms(error[early]) * 1e3,
        'last minute [ms]': rms(error[late]) * 1e3,
        'mean of it [ms]': float(error[late].mean()) * 1e3,
        'in mid-leg, RMS [ms]': rms(_lateness(rig.middles_ns(), 0.5)) * 1e3,
    }


def _lateness(instants_ns: Times, place: float) -> Array:
    """Return how late instants at a place of each leg are [s]."""
    beams = (instants_ns - START_NS) / TRUE_BEAM_NS + 0.5
    first = round(beams[0] / DEFAULT_N_S - place)
    legs = first + np.arange(len(beams)) + place
    late: Array = (beams - legs * DEFAULT_N_S) * TRUE_BEAM_NS / NS_PER_S
    return late

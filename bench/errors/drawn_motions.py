"""The pitch of the beams on motions, encoders and joint states that are drawn at random.

Nods of any size and speed, sharp, round or sinusoidal, behind a lag, with up to two vibrations and
random ones of a band, warped; an encoder of 10, 12, 14 bits or without steps, with noise; joint
states at 20 to 333 Hz, with stamps that are off, or missing. A row is for all motions, or those of
a kind; a motion may be of several.
"""

from dataclasses import dataclass

from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig
from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from scipy.signal import lfilter

from bench.errors.pitch_motions import DURATION, pitch_errors
from bench.shared.reference import START_NS
from bench.shared.report import Row
from bench.shared.rms import rms

MOTIONS = 1000
FIRST_SEED = 1000  # earlier ones were drawn when the constants of trajectory were chosen
STEP = 2e-4  # of the true motion [s]
BAND = 60  # random vibrations of a band
LONGEST_GAP = 0.5  # s
LIMITS = (0.9, 1.02, 1.1)
ENCODERS = (5.11e-3, 1.53e-3, 3.8e-4, 0.0)  # steps [rad]
TITLE = f'RMS pitch error of trajectory over that of slerp, {MOTIONS} motions drawn at random'


@dataclass(frozen=True, slots=True)
class Drawn:
    """A motion at instants, its joint samples, and what counts in it.

    Attributes
    ----------
    time, pitch
        Of the motion [s], [rad], shape (k,).
    sample_ns, sample_pitch
        Of the joint samples [ns], [rad], shape (n,).
    fastest
        The fastest vibration, per joint state; 0 without any.
    encoder_step
        In radians.
    faulty
        Whether stamps are off, or samples are missing.
    """

    time: Array
    pitch: Array
    sample_ns: Times
    sample_pitch: Array
    fastest: float
    encoder_step: float
    faulty: bool


def results() -> list[Row]:
    """Return a row for all motions and for each kind."""
    measured = [
        (_ratio(motion), motion.fastest, motion.encoder_step, motion.faulty)
        for motion in map(drawn, range(FIRST_SEED, FIRST_SEED + MOTIONS))
    ]
    ratios, fastest, step, faulty = map(np.array, zip(*measured, strict=True))
    kinds = {
        'all': np.ones(MOTIONS, bool),
        'no vibration': fastest == 0.0,
        'vibrations below half the rate': (fastest > 0.0) & (fastest < 0.5),
        'vibrations above': fastest >= 0.5,
        'stamps off, samples missing': faulty,
        'encoder of 10 bits': step == ENCODERS[0],
    }
    return [_row(kind, ratios[chosen]) for kind, chosen in kinds.items()]


def drawn(seed: int) -> Drawn:
    """Return a motion drawn at random."""
    rng = np.random.default_rng([seed, 1])
    time = np.arange(-1.0, DURATION + 1.0, STEP)
    rate = float(rng.choice([20.0, 31.0, 50.0, 62.0, 80.0, 100.0, 125.0, 200.0, 333.0]))
    pitch, fastest = _shaken(rng, time, _nod(rng, time))
    sample_s = np.arange(0.0, DURATION + 0.5, 1.0 / rate)
    step, noise = float(rng.choice(ENCODERS)), rng.uniform(0.0, 1.0) * (rng.random() < 0.5)
    off = _log_uniform(rng, 5e-5, 1e-3) * (rng.random() < 0.4)
    missing = rng.uniform(0.0, 0.1) * (rng.random() < 0.2)
    scale = step or ENCODERS[2]
    sampled = np.interp(sample_s, time, pitch) + noise * scale * rng.normal(size=len(sample_s))
    if step:
        sampled = np.rint(sampled / step) * step
    stamp_s = sample_s + off * rng.normal(size=len(sample_s))
    kept = np.flatnonzero(rng.random(len(sample_s)) >= missing)
    kept = kept[np.argsort(stamp_s[kept], kind='stable')]
    return Drawn(
        time=time,
        pitch=pitch,
        sample_ns=START_NS + np.rint(stamp_s[kept] * NS_PER_S).astype(np.int64),
        sample_pitch=sampled[kept],
        fastest=fastest / rate,
        encoder_step=step,
        faulty=bool(off or missing),
    )


def _nod(rng: np.random.Generator, time: Array) -> Array:
    """Return the pitch of a nod of any shape, behind a lag, warped [rad]."""
    half, duration = rng.uniform(0.1, 1.0), _log_uniform(rng, 0.25, 5.0)
    triangle = 1.0 - 2.0 * np.abs((time / duration) % 2.0 - 1.0)
    sine = np.sin(np.pi / 2.0 * triangle)
    shape = rng.choice(['sharp', 'round', 'sine', 'between'])
    reversal = min(4.0 * half / duration / _log_uniform(rng, 20.0, 1000.0), 0.9 * duration)
    blend = np.ones(max(1, round(reversal / STEP)))
    shapes = {
        'sharp': triangle,
        'round': np.convolve(triangle, blend / len(blend), 'same'),
        'sine': sine,
        'between': (triangle + sine) / 2.0,
    }
    nod = half * shapes[str(shape)]
    if rng.random() < 0.5:
        share = STEP / max(STEP, rng.uniform(0.0, 0.03))
        start = [nod[0] * (1.0 - share)]
        nod = lfilter([share], [1.0, share - 1.0], nod, zi=start)[0]
    warp = rng.uniform(0.0, 0.05) * (rng.random() < 0.4)
    return np.asarray(nod + warp * half / np.pi * np.sin(np.pi * nod / half))


def _shaken(rng: np.random.Generator, time: Array, pitch: Array) -> tuple[Array, float]:
    """Return a nod with vibrations [rad], and the highest frequency of these [Hz]."""
    fastest = 0.0
    for _ in range(rng.integers(0, 3)):
        amplitude, frequency = _log_uniform(rng, 2e-4, 6e-3), _log_uniform(rng, 1.0, 80.0)
        pitch = pitch + amplitude * np.sin(2.0 * np.pi * (frequency * time + rng.uniform()))
        fastest = max(fastest, frequency)
    if rng.random() < 0.4:
        lowest, highest = sorted(_log_uniform(rng, 0.5, 60.0) for _ in range(2))
        amplitude = _log_uniform(rng, 1e-4, 3e-3) / np.sqrt(BAND / 2.0)
        for frequency in np.linspace(lowest, highest, BAND):
            pitch = pitch + amplitude * np.sin(2.0 * np.pi * (frequency * time + rng.uniform()))
        fastest = max(fastest, highest)
    return pitch, fastest


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _ratio(motion: Drawn) -> float:
    """Return the RMS error of trajectory over that of slerp, of scans that both place."""

    def true(times_ns: Times) -> Array:
        return np.interp((times_ns - START_NS) / NS_PER_S, motion.time, motion.pitch)

    samples = motion.sample_ns, motion.sample_pitch
    slerp, trajectory = (
        pitch_errors(EstimatorConfig(estimator=name, max_joint_gap=LONGEST_GAP), *samples, true)[0]
        for name in ('slerp', 'trajectory')
    )
    placed = np.isfinite(slerp) & np.isfinite(trajectory)
    return rms(trajectory[placed]) / rms(slerp[placed])


def _row(kind: str, ratios: Array) -> Row:
    ratios = ratios[np.isfinite(ratios)]
    return {
        'motions': kind,
        'number': len(ratios),
        'median': float(np.median(ratios)),
        **{f'above {each} [%]': 100.0 * float(np.mean(ratios > each)) for each in LIMITS},
        'worst': float(ratios.max()),
    }

"""The error of the estimated pitch of a beam, from joint samples and the motion between them."""

import math

from nodlidar_planner.error_budget.parameters import ErrorParameters
from nodlidar_planner.error_budget.swing import Swing
import numpy as np

LEG_JERK = 1e4
"""Of the jerk on the legs [rad^2/s^5], fitted to servos by physics; its sixth root counts."""
MEMORY = 5
"""Samples to either side that smoothing on a leg uses, roughly."""

_HARMONICS = np.arange(1, 50)
_PHASES, _TIMES = 48, 1500  # of the samples and of the nod, at which the motion is interpolated


def pitch_variance(parameters: ErrorParameters, swing: Swing) -> float:
    """Return the mean square of the error of the estimated pitch [rad^2].

    It counts against what a perfect encoder would report. Interpolation has the errors of its
    samples and that of the motion between them, which are independent. 'trajectory' chooses
    between interpolation and smoothing by what predicts the samples better, on legs and at
    reversals.

    Parameters
    ----------
    parameters
        Estimator, rate of the joint states and encoder.
    swing
        The nod.
    """
    noise, motion = of_samples(parameters, swing), between_samples(parameters, swing)
    if parameters.estimator == 'slerp':
        return noise + motion
    reversing = swing.reversal_time / swing.sweep_duration
    leg = min(noise, on_legs(parameters, swing))
    reversal = min(noise + motion / reversing, at_reversals(parameters, swing))
    return (1.0 - reversing) * leg + reversing * reversal


def sample_variance(parameters: ErrorParameters) -> float:
    """Return the mean square error of a joint sample [rad^2]: noise, and rounding to steps."""
    return parameters.encoder_noise**2 + parameters.encoder_step**2 / 12.0


def sample_covariance(parameters: ErrorParameters, swing: Swing, apart: int = 1) -> float:
    """Return the mean product of the errors of two samples on a leg, some samples apart [rad^2].

    The rounding error is a sawtooth over the pitch, blurred by the noise: its harmonic k has the
    power step^2 / (2 pi^2 k^2), and the noise s of two samples damps it by
    exp(-(2 pi k s / step)^2). Neighbours are speed / rate apart. So their errors are equal where
    the nod hardly moves, or moves by whole steps, and unrelated where the noise is half a step
    (Widrow and Kollar, "Quantization Noise", 2008).
    """
    step = parameters.encoder_step
    turn = 2.0 * np.pi * _HARMONICS / step
    power = step**2 / (2.0 * np.pi**2 * _HARMONICS**2)
    damped = power * np.exp(-((turn * parameters.encoder_noise) ** 2))
    return float(np.sum(damped * np.cos(turn * apart * swing.speed / parameters.joint_rate)))


def of_samples(parameters: ErrorParameters, swing: Swing) -> float:
    """Return what the errors of the samples add to an interpolated pitch [rad^2].

    Linear interpolation at a share u weighs two errors by 1 - u and u. The mean over u of the
    squares of the weights is 2/3, of twice their product 1/3.
    """
    own, shared = sample_variance(parameters), sample_covariance(parameters, swing)
    return (2.0 * own + shared) / 3.0


def between_samples(parameters: ErrorParameters, swing: Swing) -> float:
    """Return the mean square error of an interpolation of exact samples [rad^2].

    A mean over all phases of nod and samples. On a leg there is none; a reversal loses its tip.
    """
    period = 1.0 / parameters.joint_rate
    phase = (np.arange(_PHASES)[:, None] + 0.5) / _PHASES * period
    times = (np.arange(_TIMES) + 0.5) / _TIMES * 2.0 * swing.sweep_duration
    before = np.floor((times - phase) / period) * period + phase
    share = (times - before) / period
    estimate = (1.0 - share) * swing.pitch(before) + share * swing.pitch(before + period)
    return float(np.mean((estimate - swing.pitch(times)) ** 2))


def on_legs(parameters: ErrorParameters, swing: Swing) -> float:
    """Return the mean square error of the best smoother on a leg [rad^2], of jerk LEG_JERK.

    The error that MEMORY samples share remains.
    """
    shared = [sample_covariance(parameters, swing, apart) for apart in range(1, MEMORY + 1)]
    common = max(float(np.mean(shared)), 0.0)
    noise = (sample_variance(parameters) - common) / parameters.joint_rate
    return common + smoothed(noise, LEG_JERK, 3)


def at_reversals(parameters: ErrorParameters, swing: Swing) -> float:
    """Return the mean square error of the best smoother during a reversal [rad^2].

    A reversal changes the acceleration twice by a, so its jerk has the intensity 2 a^2 over its
    duration. If that is shorter than the memory of the smoother, it is a jump of the speed by
    twice the nod's.
    """
    noise = sample_variance(parameters) / parameters.joint_rate
    jerk = 2.0 * swing.acceleration**2 / swing.reversal_time
    jump = (2.0 * swing.speed) ** 2 / swing.reversal_time
    return min(smoothed(noise, jerk, 3), smoothed(noise, jump, 2))


def smoothed(noise: float, intensity: float, order: int) -> float:
    """Return the mean square error of the Wiener smoother.

    The motion's derivative of order m is white, of intensity q. Samples of variance v at a rate f
    are noise of the density R = v / f. The smoother leaves the integral of
    q R / (q + R w^2m) / 2 pi over w, which is R (q / R)^(1/2m) / (2 m sin(pi / 2m)) (Wiener,
    "Extrapolation, interpolation and smoothing of stationary time series", 1949).

    Parameters
    ----------
    noise
        R [rad^2 s].
    intensity, order
        q [rad^2 / s^(2m - 1)] and m.
    """
    power = 0.5 / order
    scale = power / math.sin(math.pi * power)
    return scale * math.pow(noise, 1.0 - power) * math.pow(intensity, power)

"""The pitch of every beam, smoothed from the joint samples around the scan.

How rough the motion of a servo is and how noisy its encoder is, nobody knows. So splines of
several roughnesses (spline_fit) compete. Each counts by how well it has predicted samples from the
others (leave-one-out cross-validation, Stone 1974). What they leave of the samples is added as far
as it is motion (unfitted_motion), and what they lack between these (between_samples).
"""

from dataclasses import dataclass

from nodlidar_assembler.clouds.between_samples import aliases, at, LAGS
from nodlidar_assembler.clouds.spline_fit import fit, KNOT, KNOT_NS, ROUGHNESS, Splines, value
from nodlidar_assembler.clouds.unfitted_motion import UnfittedMotion, usual_part
from nodlidar_assembler.clouds.white_noise import WhiteNoise
from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from scipy.special import ndtr

BEFORE_NS = 60_000_000  # time before a scan from which samples are used
PAUSE_NS = 200_000_000  # between samples, beyond which those of a scan do not reach,
LONGEST_NS = 1_000_000_000  # ... looked for only if they last longer than that
SAME = 1e-5  # difference of samples at the same step of the encoder, at most [rad]
LEAST_STEP = 3e-5  # of an encoder, about 18 bits [rad]; a finer one hardly errs by it
MOST_STEP = 5.2e-3  # of the coarsest encoder, 300 degrees in 1024 steps [rad]
MOST_NOISE = 2.5e-3  # beyond rounding, or the encoder's step if larger, RMS [rad]; more is motion
# What is white beyond a step of the encoder is noise by this share, else motion. Whether it is all
# noise or all motion, lines from sample to sample are hardly better.
SHARE_OF_NOISE = 0.25
FIRST_INTENSITY = 3.0 * ROUGHNESS  # of an interval that no scan has fitted yet
LEAST_REST = 1e-3  # share of a sample's residual that the fit leaves, at least
FAR_OFF = 3.0  # standard deviations; a sample that is farther off counts less
MISSED = 0.3  # share of the samples that a method may miss, as at a reversal,
MISSED_WITHIN = 0.1  # ... by an angle within this range [rad]
SCORE_MEMORY = 0.997  # weight of a sample in the score, over that of the next one
NOISE_MEMORY = 0.96  # the same in the learned noise
SHARE_OF_WHITE = 0.1  # of the white noise in what is learned; without, a low noise would stay low
LEARN_EVERY = 4  # scans, as the encoder's step and noise change slowly
LEAST_VARIANCE = 1e-10  # of a prediction [rad^2]


@dataclass(slots=True)
class _Window:
    """The samples around a scan, and what is known about them from it and the scans before.

    Attributes
    ----------
    first_knot
        Index of the knot at or before the first sample, counted from time 0.
    time_ns, place, pitch, weight
        Of the samples [ns], in knots from the first one, [rad] from their mean, and with which
        each counts, shape (n,).
    intensity
        q of each interval between knots, for each spline, shape (m, intervals).
    """

    first_knot: int
    time_ns: Times
    place: Array
    pitch: Array
    weight: Array
    intensity: Array

    @classmethod
    def of(cls, time_ns: Times, pitch: Array) -> '_Window':
        """Return the window of samples [ns], [rad] of which nothing is known."""
        first, last = int(time_ns[0]) // KNOT_NS, int(time_ns[-1]) // KNOT_NS
        place = (time_ns - first * KNOT_NS) / KNOT_NS
        intensity = FIRST_INTENSITY.repeat(last - first + 1, axis=1)
        return cls(first, time_ns, place, pitch, np.ones(len(time_ns)), intensity)

    def take_over(self, last: '_Window') -> None:
        """Take over what is known from the last window, where the two overlap."""
        shift = self.first_knot - last.first_knot
        here, there = max(0, -shift), max(0, shift)
        known = last.intensity[:, there:][:, : max(0, self.intensity.shape[1] - here)]
        self.intensity[:, here : here + known.shape[1]] = known
        gone = int(last.time_ns.searchsorted(self.time_ns[0]))
        both = min(len(last.time_ns) - gone, len(self.time_ns))
        same = last.time_ns[gone : gone + both] == self.time_ns[:both]
        np.copyto(self.weight[:both], last.weight[gone : gone + both], where=same)


class PitchSmoother:
    """Smooths the joint samples around each scan, and learns from them.

    Scans come in the order of time; after a step of the clock it learns anew.
    """

    def __init__(self) -> None:
        self._step = np.inf  # of the encoder, inf if unknown [rad]
        # Width of the range of angles that the encoder reports as one [rad], and the variance of
        # the error that it causes [rad^2].
        self._cell, self._rounding = LEAST_STEP, LEAST_STEP**2 / 12.0
        self._white_noise = WhiteNoise()
        self._noise = np.zeros_like(ROUGHNESS)  # beyond rounding, for each spline [rad^2]
        self._noise_known = False
        self._unfitted = UnfittedMotion()
        self._score = np.zeros(len(ROUGHNESS))  # log probability of each spline
        self._scans = 0  # that had new samples
        self._start_ns = 0  # of the last scan [ns]
        self._last: _Window | None = None

    def pitch(
        self, start_ns: int, offset: Array, sample_ns: Times, sample_pitch: Array, line: Array
    ) -> Array:
        """Return the pitch of each beam [rad], shape (n,).

        It differs from the interpolated samples by at most half of the largest step from sample to
        sample, which a reversal between two samples can cause, plus two steps of the encoder.

        Parameters
        ----------
        start_ns
            Instant of the first beam [ns].
        offset
            Time of each beam after the first [s], ascending, shape (n,).
        sample_ns, sample_pitch
            Joint samples [ns], [rad], ascending, shape (m,), which bracket the beams.
        line
            The pitch of each beam, interpolated between them [rad], shape (n,).

        Raises
        ------
        SplineError
            If the samples do not determine a spline.
        """
        self._white_noise.add(sample_ns, sample_pitch)
        end_ns = start_ns + round(float(offset[-1]) * NS_PER_S)
        around = _around(sample_ns, start_ns, end_ns)
        sample_ns, sample_pitch = sample_ns[around], sample_pitch[around]
        middle = float(np.add.reduce(sample_pitch)) / len(sample_pitch)
        window = _Window.of(sample_ns, sample_pitch - middle)
        if self._last is not None:
            window.take_over(self._last)
        if self._scans % LEARN_EVERY == 0:
            self._learn_step(window.pitch)
        noise = self._rounding + self._noise
        splines = fit(window.place, window.pitch, noise, window.weight, window.intensity)
        new = self._learn(splines, window, noise, start_ns)
        share = np.exp(self._score - np.logaddexp.reduce(self._score))
        fitted = share @ splines.pitch
        left = window.pitch - fitted
        usual = usual_part(left, self._rounding)
        if new.start < new.stop:
            self._scans += 1
            if self._scans % LEARN_EVERY == 0:
                self._learn_noise(splines, window, new, share, usual)
        place = (start_ns - window.first_knot * KNOT_NS) / KNOT_NS + offset / KNOT
        smooth = value(share @ splines.coefficients, place)
        variance = float(share @ noise[:, 0])
        unfitted = self._unfitted.motion(left, usual, variance) + aliases(window.place, fitted)
        pitch = middle + (smooth + at(place, window.place, unfitted))
        largest = np.maximum.reduce(np.abs(window.pitch[1:] - window.pitch[:-1]), initial=0.0)
        beyond = largest / 2.0 + 2.0 * self._cell
        return np.asarray(np.minimum(np.maximum(pitch, line - beyond), line + beyond))

    def _learn_step(self, pitch: Array) -> None:
        ordered = np.sort(pitch)
        self._step = _common_step(self._step, ordered[1:] - ordered[:-1])
        if self._step < np.inf:
            self._cell = min(max(self._step, LEAST_STEP), MOST_STEP)
            self._rounding = self._cell**2 / 12.0

    def _learn(self, splines: Splines, window: _Window, noise: Array, start_ns: int) -> slice:
        """Score the splines by the samples since the last scan, which are returned."""
        rest = np.maximum(1.0 - splines.variance * splines.information, LEAST_REST)
        error, variance = (window.pitch - splines.pitch) / rest, splines.variance / rest
        weight = _weight(error[-1], variance[-1] + noise[-1])
        first = max(1, int(window.time_ns.searchsorted(self._start_ns)))
        last = min(len(window.time_ns) - 1, int(window.time_ns.searchsorted(start_ns)))
        new = slice(first, last)
        if new.start < new.stop:
            self._learn_score(error[:, new], variance[:, new])
        self._start_ns = start_ns
        window.intensity, window.weight = splines.intensity, weight
        self._last = window
        return new

    def _learn_score(self, error: Array, variance: Array) -> None:
        """Score the splines by their errors at samples that are left out.

        A spline is right if it predicts the step that the encoder reads.

        Parameters
        ----------
        error, variance
            Of each spline [rad], [rad^2], shape (m, k).
        """
        scale = 1.0 / np.sqrt(variance + self._noise + LEAST_VARIANCE)
        half = self._cell / 2.0
        hit = ndtr((error + half) * scale) - ndtr((error - half) * scale)
        missed = MISSED * self._cell / MISSED_WITHIN
        score = np.add.reduce(np.log((1.0 - MISSED) * hit + missed), axis=1)
        self._score = self._score * SCORE_MEMORY ** error.shape[1] + score

    def _learn_noise(
        self, splines: Splines, window: _Window, new: slice, share: Array, usual: Array
    ) -> None:
        """Learn the noise beyond rounding, and how much of what the splines leave is motion.

        Noise is what a spline leaves, if it is white: vibrations, which a smooth spline leaves as
        well, are motion.
        """
        rounding = self._rounding
        noise = rounding + self._noise
        memory = NOISE_MEMORY ** (new.stop - new.start)
        square = (window.pitch[new] - splines.pitch[:, new]) ** 2 + splines.variance[:, new]
        square = np.minimum(square, (2.0 * FAR_OFF) ** 2 * noise)
        beyond = np.add.reduce(square, axis=1, keepdims=True) / square.shape[1] - rounding
        white = self._white_noise.variance()
        beyond += SHARE_OF_WHITE * (max(0.0, white - rounding) - beyond)
        learned = memory * self._noise + (1.0 - memory) * beyond
        if not self._noise_known and white:
            # From 0, it would stay there: a spline without noise passes through all samples.
            learned, self._noise_known = np.full_like(learned, white), True
            # What was learned without it does not count.
            self._score, self._unfitted = np.zeros(len(ROUGHNESS)), UnfittedMotion()
        influence = share @ splines.influence(new, LAGS)
        self._unfitted.add(usual, new, influence, self._noise_in(white), white)
        self._noise = np.maximum(0.0, np.minimum(learned, white - rounding))

    def _noise_in(self, white: float) -> float:
        """Return how much of what is white counts as noise, and not as motion [rad^2].

        Random vibrations of all frequencies up to half the rate are white as well, and an encoder
        errs by a step; one without steps may err by anything.
        """
        rounding, cell = self._rounding, self._cell
        noise = min(max(white, rounding), rounding + max(MOST_NOISE, cell) ** 2)
        usual = rounding + cell**2 if cell > LEAST_STEP else noise
        return min(noise, usual + SHARE_OF_NOISE * (noise - usual))


def _common_step(step: float, difference: Array) -> float:
    """Return the largest step of which this one and all differences are multiples [rad].

    It is Euclid's algorithm. The least difference alone would not do: samples of a fine encoder
    whose rate fits the nod repeat, and stay far from each other.
    """
    rest = difference[difference > SAME]
    while len(rest):
        step = min(step, float(rest.min()))
        if step < LEAST_STEP:
            break
        rest = np.abs(difference - step * np.rint(difference / step))
        rest = rest[rest > SAME]
    return step


def _around(sample_ns: Times, start_ns: int, end_ns: int) -> slice:
    """Return the samples around a scan [ns], none beyond a pause before or after it."""
    first = max(0, int(sample_ns.searchsorted(start_ns - BEFORE_NS, side='right')) - 1)
    last = len(sample_ns)
    if sample_ns[-1] - sample_ns[first] > LONGEST_NS:
        pauses = first + np.flatnonzero(sample_ns[first + 1 :] - sample_ns[first:-1] > PAUSE_NS)
        before = pauses[sample_ns[pauses + 1] <= start_ns]
        after = pauses[sample_ns[pauses] >= end_ns]
        first = int(before[-1]) + 1 if len(before) else first
        last = int(after[0]) + 1 if len(after) else last
    return slice(first, last)


def _weight(error: Array, variance: Array) -> Array:
    """Return the weights of samples with errors [rad] of a variance [rad^2] if left out, (n,)."""
    far = FAR_OFF**2 * variance
    return np.asarray(far / np.maximum(error**2, far))

"""The configured estimator: which joint samples it needs, and the pitch of a scan's beams."""

from collections import Counter
from dataclasses import dataclass

from nodlidar_assembler.clouds.joint_history import JointSamplesConfig
from nodlidar_assembler.clouds.pitch import (
    beam_pitch,
    ordered_samples,
    PitchError,
    require_no_jump,
    SplineError,
)
from nodlidar_assembler.clouds.recent_samples import RecentSamples
from nodlidar_common.arrays import Array, Times
from nodlidar_common.parameters import parameter
from nodlidar_common.stamps import NS_PER_S

ESTIMATORS = ('nearest', 'ends', 'slerp', 'trajectory')
SMOOTHING_MARGIN = 0.15  # with less, reversals are less exact [s]


@dataclass(frozen=True)
class EstimatorConfig(JointSamplesConfig):
    """Estimator of the pitch."""

    estimator: str = parameter(
        'slerp',
        'Estimator of the pitch of a beam: nearest (one joint sample per scan), ends (linear from '
        'the first to the last beam), slerp (interpolated per beam) or trajectory (smoothed over '
        'the joint samples around the scan)',
        choices=ESTIMATORS,
    )
    smoothing_margin: float = parameter(
        SMOOTHING_MARGIN,
        'How long after a scan the estimator trajectory waits for joint samples; clouds are later '
        'by as much, or by the deadline if that is less',
        unit='s',
        minimum=0.0,
        maximum=2.0,
    )


class PitchEstimator:
    """Computes the pitch of each beam of a scan.

    ``trajectory`` is pitch_smoother.PitchSmoother, or ``slerp`` where the samples determine no
    spline; for the others see pitch.beam_pitch.

    Attributes
    ----------
    margin_ns
        Time before and after a scan from which joint samples are used, if available [ns].
    fallbacks
        Scans with ``slerp`` instead of ``trajectory``, counted by reason.
    """

    def __init__(self, config: EstimatorConfig) -> None:
        self._smoother = None
        if config.estimator == 'trajectory':
            # Imported here: SciPy is a fifth of the start of a node, and no other needs it.
            from nodlidar_assembler.clouds.pitch_smoother import PitchSmoother

            self._smoother = PitchSmoother()
        self._interpolation = 'slerp' if self._smoother else config.estimator
        self._max_joint_gap = config.max_joint_gap
        self.margin_ns = round(config.smoothing_margin * NS_PER_S) if self._smoother else 0
        self._recent = RecentSamples()
        self.fallbacks: Counter[str] = Counter()

    def pitch(
        self,
        start_ns: int,
        offset: Array,
        sample_ns: Times,
        sample_pitch: Array,
    ) -> Array:
        """Return the pitch of each beam [rad], shape (n,).

        Parameters
        ----------
        start_ns, offset
            Instant of the first beam [ns], time of each beam after it [s], ascending, shape (n,).
        sample_ns, sample_pitch
            Joint samples around the scan [ns], [rad], shape (m,), in any order.

        Raises
        ------
        PitchError
            If the samples do not bracket the beams, or are too far apart.
        """
        samples = ordered_samples(sample_ns, sample_pitch)
        self._recent.add(*samples)
        pitch = beam_pitch(self._interpolation, start_ns, offset, *samples, self._max_joint_gap)
        if self._interpolation == 'nearest':
            return pitch
        end_ns = start_ns + round(float(offset[-1]) * NS_PER_S)
        require_no_jump(*samples)
        if self._recent.may_hide_reversal(start_ns, end_ns, *samples):
            raise PitchError('joint samples missing at a reversal')
        if self._smoother is not None:
            try:
                return self._smoother.pitch(start_ns, offset, *samples, pitch)
            except SplineError as error:
                self.fallbacks[str(error)] += 1
        return pitch

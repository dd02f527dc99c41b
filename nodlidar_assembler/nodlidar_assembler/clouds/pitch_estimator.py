"""The configured estimator: which joint samples it needs, and the pitch of a scan's beams."""

from collections import Counter
from dataclasses import dataclass

from nodlidar_assembler.clouds.joint_order import JointSamplesConfig
from nodlidar_assembler.clouds.leg_model import leg_pitch, LegModelError
from nodlidar_assembler.clouds.pitch import beam_pitch, ordered_samples, require_reversals_sampled
from nodlidar_assembler.clouds.usual_gap import UsualGap
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.parameters import parameter
import numpy as np
from numpy.typing import NDArray

ESTIMATORS = ('nearest', 'ends', 'slerp', 'trajectory')
JOINT_STEP = 0.00511  # of the RX-24F's encoder, 300 degrees / 1024 [rad]
LEG_MARGIN = 0.2  # half a leg of the reference nod [s]


@dataclass(frozen=True)
class EstimatorConfig(JointSamplesConfig):
    """Estimator of the pitch."""

    estimator: str = parameter(
        'slerp',
        'Estimator of the pitch of a beam: nearest (one joint sample per scan), ends (linear from '
        'the first to the last beam), slerp (interpolated per beam) or trajectory (legs of '
        'constant speed fitted to the joint samples; slerp where the fit fails)',
        choices=ESTIMATORS,
    )
    leg_margin: float = parameter(
        LEG_MARGIN,
        'Time before and after a scan from which trajectory fits joint samples; clouds are later '
        'by as much, or by the deadline if that is less',
        unit='s',
        minimum=0.0,
        maximum=2.0,
    )
    joint_step: float = parameter(
        JOINT_STEP,
        'Step of the joint encoder; trajectory rejects a fit that a sample misses by more',
        unit='rad',
        minimum=1e-6,
        maximum=0.1,
    )


class PitchEstimator:
    """Computes the pitch of each beam of a scan.

    ``trajectory`` is leg_model.leg_pitch, or ``slerp`` where the fit fails; for the others see
    pitch.beam_pitch.

    Attributes
    ----------
    margin_ns
        Time before and after a scan from which joint samples are used, if available [ns].
    fallbacks
        Scans with ``slerp`` instead of ``trajectory``, counted by reason.
    """

    def __init__(self, config: EstimatorConfig) -> None:
        self._name = config.estimator
        self._interpolation = 'slerp' if self._name == 'trajectory' else self._name
        self._max_joint_gap = config.max_joint_gap
        self._joint_step = config.joint_step
        leg_margin = config.leg_margin if self._name == 'trajectory' else 0.0
        self.margin_ns = round(leg_margin * NS_PER_S)
        self._usual_gap = UsualGap()
        self.fallbacks: Counter[str] = Counter()

    def pitch(
        self,
        start_ns: int,
        offset: NDArray[np.float64],
        sample_ns: NDArray[np.int64],
        sample_pitch: NDArray[np.float64],
    ) -> NDArray[np.float64]:
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
        usual_gap = self._usual_gap.add(samples[0])
        pitch = beam_pitch(self._interpolation, start_ns, offset, *samples, self._max_joint_gap)
        if self._name == 'nearest':
            return pitch
        fallback = Counter[str]()
        if self._name == 'trajectory':
            try:
                return leg_pitch(start_ns, offset, *samples, self._joint_step)
            except LegModelError as error:
                fallback[str(error)] += 1
        times = (samples[0] - start_ns) / NS_PER_S
        require_reversals_sampled(offset, times, samples[1], usual_gap)
        self.fallbacks += fallback
        return pitch

"""The assembler's state on /diagnostics."""

from collections import Counter
from collections.abc import Callable, Sequence
import math

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.revolutions import GATE_NS
from nodlidar_assembler.plausibility.nod_following import NodFollowing
from nodlidar_assembler.plausibility.odometry_check import OdometryCheck
from nodlidar_assembler.plausibility.stamp_drift import SCANS, StampDrift
from nodlidar_assembler.plausibility.sweep_agreement import SweepAgreement
from nodlidar_assembler.ros.assembly_filter import AssemblyFilter
from nodlidar_assembler.ros.input import PolledInput, SingleInput
from nodlidar_assembler.scan_assembler import ONE_INSTANT, Outcome
from nodlidar_common.nod import Nod
from nodlidar_common.recent import Recent
from nodlidar_common.ros.diagnostics import SteadyUpdater
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.ros.tf_odometry import TfOdometry
from nodlidar_common.silence import LEAST_SILENCE, Silence
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.survival import Survival
from rclpy.node import Node

_RECENT = 1.0  # s, for which drops, losses and errors are reported
_BLIND = 3.0  # s without a range; in a hall, a sweep may have none for a second
_BEHIND = 2.0  # s; scans that come this long after odometry of their time are of another clock
_SCAN_END = 'the end of each scan'
_AHEAD = 0.1  # s; what is stamped later than now by more is of another clock
# A scan cannot come before its last beam. Those that do by more than this [s], and than half of
# the time of their beams, are stamped when they end.
_EARLY = 0.01
# s; what comes later after its stamp than the other input by more is of another clock. A scan that
# does not state the time of its beams comes a revolution late.
_APART = 0.3
_UNPLACED = 5.0  # s beyond the deadline, in which no scan was placed
_STANDS = 2.0  # s by a steady clock, in which simulated time did not go on


class Diagnosis:
    """Counts inputs and outputs, and reports once a second; changes of the state at once.

    Parameters
    ----------
    node, config
        The assembler and its parameters at start; frame_id is the hardware ID.
    assembly, odometry
        Count drops and name missing inputs.
    scans, states
        The inputs; they count losses and publishers. The joint states are taken at least as often
        as the state is checked, so that silence is noticed and none is lost.
    survival
        Counts internal errors.
    commanded
        Returns the nod that is commanded at present, if any.

    Attributes
    ----------
    agreement
        Takes the assembled scans, and warns if the calibration is off.
    """

    def __init__(
        self,
        node: Node,
        config: AssemblerConfig,
        assembly: AssemblyFilter,
        odometry: TfOdometry | None,
        scans: SingleInput,
        states: PolledInput,
        survival: Survival,
        commanded: Callable[[], Nod | None],
    ) -> None:
        self._node, self._assembly, self._odometry = node, assembly, odometry
        self._joint_name, self._survival = config.joint_name, survival
        self._longest = config.deadline + _UNPLACED  # without a scan that was placed [s]
        self._scans, self._states = scans, states
        self.counts = Counter(scans=0, beams=0, clouds=0, points=0)
        # A simulation may be so slow that the second message is late.
        first = math.inf if node.get_clock().ros_time_is_active else LEAST_SILENCE
        self._scan_silence, self._joint_silence = Silence(first), Silence(first)
        self._odometry_silence = Silence(first)
        self._placed_ns: int | None = None  # when a scan was placed, or the first one came
        self._range_ns: int | None = None  # of the last scan with a range, or of the first one
        self._odometry_ns: int | None = None
        self._simulated_ns, self._went_on_ns = 0, steady_ns()  # simulated time, and when it did
        self._commanded, self._following = commanded, NodFollowing()
        self._odometry_check, self._drift = OdometryCheck(), StampDrift()
        self._drifting = False
        assembly.samples.registerCallback(self._sample_arrived)
        assembly.odometry.registerCallback(self._odometry_arrived)
        assembly.registerCallback(self._decided)
        self._recent = Recent(_RECENT)
        self._recent.add(steady_ns(), Counter())
        self._latency = self._restamped = self._scan_lasts = 0.0
        self._ahead_ns = Counter[str]()  # by how much the last message was stamped after it came
        self._behind = 0.0  # by how much the last scan ended before the newest odometry [s]
        self.agreement = SweepAgreement()
        self.updater = SteadyUpdater(node, config.frame_id, self._state)
        self.updater.add('clouds', self._report)

    def scan_arrived(self, scan: Scan) -> None:
        """Count a scan."""
        now_ns = steady_ns()
        self.counts.update(scans=1, beams=len(scan.ranges))
        if self._placed_ns is None or self._scan_silence.seconds(now_ns):
            self._placed_ns = now_ns
        self._scan_silence.heard(now_ns, scan.stamp_ns)
        self._note_late(SCANS, scan.end_ns, self._scans.arrived_ns)
        self._scan_lasts = (scan.end_ns - scan.stamp_ns) / NS_PER_S
        if self._odometry is not None and self._odometry.newest_ns is not None:
            self._behind = (self._odometry.newest_ns - scan.end_ns) / NS_PER_S
        if self._range_ns is None or scan.geometry.measured(scan.ranges).any():
            self._range_ns = now_ns

    def cloud_published(self, now_ns: int, cloud: Points) -> None:
        """Count a cloud, and note its latency after the last point."""
        self.counts.update(clouds=1, points=len(cloud.data))
        self._latency = (now_ns - int(cloud.time_ns[-1])) / NS_PER_S

    def _decided(self, outcome: Outcome) -> None:
        if outcome.assembled is not None:
            self._placed_ns = steady_ns()

    def clock_was_set(self) -> None:
        """Forget what was learned from stamps of the time before."""
        self.agreement.restart()
        self._drift.restart()

    def _sample_arrived(self, time_ns: int, pitch: float) -> None:
        now_ns = steady_ns()
        if self._joint_silence.seconds(now_ns):
            self._placed_ns = now_ns  # no scan could be placed meanwhile
        self._joint_silence.heard(now_ns, time_ns)
        self._note_late(self._joint_name, time_ns, self._states.arrived_ns)
        self._following.add(time_ns, pitch, self._commanded())

    def _odometry_arrived(
        self, time_ns: int, position: Sequence[float], orientation: Sequence[float]
    ) -> None:
        self._odometry_check.add(time_ns, position, orientation)
        if self._odometry is not None:
            self._note_late('odometry', time_ns, time_ns - self._odometry.ahead_ns)

    def _note_late(self, name: str, measured_ns: int, arrived_ns: int) -> None:
        """Note when a message arrived [ns]; 0 if it is unknown, as in simulated time."""
        self._ahead_ns[name] = measured_ns - arrived_ns if arrived_ns else 0
        if arrived_ns and not self._node.get_clock().ros_time_is_active:
            self._drift.add(name, arrived_ns - measured_ns, steady_ns())

    def _silences(self) -> dict[str, float]:
        """Return the silent inputs, with the duration of their silence [s]."""
        now_ns = steady_ns()
        silences = {
            'scan': self._scan_silence,
            f"position of '{self._joint_name}'": self._joint_silence,
            'odometry': self._odometry_silence,
        }
        seconds = {name: silence.seconds(now_ns) for name, silence in silences.items()}
        return {name: silent for name, silent in seconds.items() if silent}

    def _state(self) -> object:
        """Return the present faults, to be reported at once when they change."""
        self._states.take()
        now_ns = steady_ns()
        self._watch_simulated_time(now_ns)
        self._hear_odometry(now_ns)
        self._assembly.release()
        self._recent.add(now_ns, self._losses())
        faults = self._recent.counts, *self._doubts()
        return [*self._silences()], [*map(bool, faults)], self._shared_inputs()

    def _watch_simulated_time(self, now_ns: int) -> None:
        clock = self._node.get_clock()
        simulated_ns = int(clock.now().nanoseconds) if clock.ros_time_is_active else now_ns
        if simulated_ns != self._simulated_ns:
            self._simulated_ns, self._went_on_ns = simulated_ns, now_ns

    def _standstill(self) -> str:
        """Return for how long simulated time has stood still; empty if it goes on."""
        stands = (steady_ns() - self._went_on_ns) / NS_PER_S
        return f'/clock has stood still for {stands:.0f} s' if stands > _STANDS else ''

    def _hear_odometry(self, now_ns: int) -> None:
        odometry = self._odometry
        if odometry is None:
            return
        odometry.take()
        if odometry.newest_ns != self._odometry_ns:
            self._odometry_ns = odometry.newest_ns
            self._odometry_silence.heard(now_ns)

    def _blindness(self) -> str:
        """Return for how long scans have come without a range; empty if they have some."""
        now_ns = steady_ns()
        blind = 0.0 if self._range_ns is None else (now_ns - self._range_ns) / NS_PER_S
        if blind < _BLIND or self._scan_silence.seconds(now_ns):
            return ''
        return f'no range for {blind:.0f} s: is the lidar covered?'

    def _restamping(self) -> str:
        """Return by how much stamps of scans moved; empty if not, or if they proved right."""
        timing = self._assembly.assembler.timing
        if timing.restamped != self._restamped:
            self._restamped = timing.restamped
            self.agreement.restart()
        elif self.agreement.excludes(self._restamped):
            timing.trust_stamps()
            self._restamped = 0.0
        if abs(self._restamped) * NS_PER_S <= GATE_NS:
            return ''
        way = 'later' if self._restamped > 0.0 else 'earlier'
        moved = f'{abs(self._restamped) * 1e3:.0f} ms {way}'
        return f'scans are stamped {moved} than before, but come as before: check their driver'

    def _drifted(self) -> str:
        """Return by how much stamps drifted; empty if not, or if they proved right."""
        moved = self._drift.moved
        if (self._joint_name in moved) != self._drifting:
            self._drifting = not self._drifting
            self.agreement.restart()  # its last window may be of before
        elif self.agreement.excludes(moved.get(self._joint_name, 0.0)):
            self._drift.forget(self._joint_name)
        if not moved:
            return ''
        name, by = max(moved.items(), key=lambda each: abs(each[1]))
        way = 'later' if by > 0.0 else 'earlier'
        return (
            f'stamps of scans drifted: they are {abs(by) * 1e3:.0f} ms {way} than at first, '
            f'compared with those of {name}, but come as before: check both clocks'
        )

    def _clock_ahead(self) -> str:
        """Return which input is of a clock ahead of that of scans or host; empty if none is."""
        odometry = self._odometry
        if odometry is not None and self._behind > _BEHIND:
            return f'odometry is stamped {self._behind:.1f} s after scans: synchronise the clocks'
        # If the clouds are late by less than nothing, it is the host's clock that is behind; a
        # simulated clock moves in steps.
        if self._latency < 0.0 or self._node.get_clock().ros_time_is_active:
            return ''
        inputs = {
            f"'{self._joint_name}'": self._ahead_ns[self._joint_name],
            _SCAN_END: self._ahead_ns[SCANS],
            'odometry': 0 if odometry is None else odometry.ahead_ns,
        }
        name, ahead_ns = max(inputs.items(), key=lambda each: each[1])
        ahead = ahead_ns / NS_PER_S
        if ahead < _AHEAD:
            return self._early_scans()
        remedy = 'synchronise the clocks'
        if name == _SCAN_END:
            remedy += ', or set scan_delay if scans are stamped when they end'
        return f'{name} is stamped {ahead:.2f} s in the future: {remedy}'

    def _early_scans(self) -> str:
        """Return how long before their last beam scans come; empty if they do not."""
        early = self._drift.early_scans
        if early <= max(_EARLY, self._scan_lasts / 2.0):
            return ''
        return (
            f'scans come {early:.3f} s before their last beam: set scan_delay if they are stamped '
            'when they end, else synchronise the clocks'
        )

    def _clocks_apart(self) -> str:
        """Return whether scans or joint states come much later than the other ones."""
        apart = self._drift.apart(self._joint_name)
        if abs(apart) < _APART:
            return ''
        late, other = ('joint states', 'scans') if apart > 0.0 else ('scans', 'joint states')
        return (
            f'{late} come {abs(apart):.2f} s later after their stamps than {other}: if the clocks '
            'differ, points are wrong; synchronise them'
        )

    def _losses(self) -> Counter[str]:
        """Return the numbers of drops, losses, wrong clouds and internal errors so far."""
        assembler = self._assembly.assembler
        losses = Counter({f'dropped: {why}': n for why, n in assembler.drops.items()})
        losses[ONE_INSTANT] = assembler.remarks.get(ONE_INSTANT, 0)
        losses['dropped: scan of a second publisher'] = self._scans.of_others
        for name, one in (('scans', self._scans), ('joint states', self._states)):
            losses[f'lost before they arrived: {name}'] = one.publishers.lost
        losses.update({f'internal error: {k}': n for k, n in self._survival.errors.items()})
        return losses

    def _shared_inputs(self) -> dict[str, int]:
        """Return the inputs with more than one publisher, and the number of these."""
        publishers = self._node.count_publishers(self._scans.sub.topic_name)
        active = {
            self._scans.sub.topic_name: publishers,
            f"'{self._joint_name}'": self._states.publishers.active,
            **({} if self._odometry is None else self._odometry.shared),
        }
        return {what: count for what, count in active.items() if count > 1}

    def _report(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        status.summary(DiagnosticStatus.OK, 'publishing clouds')
        if not self.counts['scans']:
            status.summary(DiagnosticStatus.STALE, 'no scan received yet')
        for text in self._silent():
            status.mergeSummary(DiagnosticStatus.ERROR, text)
        for text in self._warnings():
            status.mergeSummary(DiagnosticStatus.WARN, text)
        for name, count in (
            self.counts | self._assembly.assembler.remarks | self._losses()
        ).items():
            status.add(name, str(count))
        status.add('revolutions without a scan', str(self._assembly.assembler.timing.missing))
        status.add('joint delay by the sweeps [ms]', f'{self.agreement.delay * 1e3:.2f}')
        status.add('latency after the last point [s]', f'{self._latency:.4f}')
        return status

    def _silent(self) -> list[str]:
        silences = self._silences()
        if 'scan' in silences and steady_ns() - self._assembly.refused_ns < _RECENT * NS_PER_S:
            silences['usable scan'] = silences.pop('scan')
        texts = [f'no {name} for {silent:.1f} s' for name, silent in silences.items()]
        texts += filter(None, [self._assembly.assembler.missing_input])
        return texts or self._unplaced()

    def _unplaced(self) -> list[str]:
        """Return for how long scans have come of which none was placed; nothing if some were."""
        now_ns = steady_ns()
        unplaced = 0.0 if self._placed_ns is None else (now_ns - self._placed_ns) / NS_PER_S
        return [f'no scan was placed for {unplaced:.0f} s'] if unplaced > self._longest else []

    def _warnings(self) -> list[str]:
        texts = [
            f'{count} publishers of {what}: stop all but one'
            for what, count in self._shared_inputs().items()
        ]
        texts += [f'{count} {what}' for what, count in self._recent.counts.most_common(1)]
        return [*texts, *filter(None, self._doubts())]

    def _doubts(self) -> list[str]:
        """Return what is wrong with inputs that come; empty texts for what is not."""
        return [
            self._standstill(),
            self._blindness(),
            self._clock_ahead() or self._clocks_apart(),
            *self._assembly.assembler.doubts,
            '' if self._odometry is None else self._odometry_check.warning,
            self._restamping() or self._drifted(),
            self._following.warning,
            self.agreement.warning,
        ]

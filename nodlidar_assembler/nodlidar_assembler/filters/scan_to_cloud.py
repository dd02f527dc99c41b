"""The way of a scan to its cloud: filters and pipeline, in the node and for bags alike."""

from collections import Counter
from collections.abc import Callable
from typing import Protocol

from message_filters import SimpleFilter
from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryError
from nodlidar_assembler.clouds.joint_history import JointSamples
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.clouds.pipeline import Pipeline, Scan
from nodlidar_assembler.clouds.pitch import PitchError
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.filters.bracket_filter import BracketFilter
from nodlidar_assembler.filters.joint_filter import JointFilter
from nodlidar_assembler.filters.odometry_filter import OdometryFilter
from nodlidar_assembler.filters.scan_message import geometry_from_message, scan_from_message
from sensor_msgs.msg import LaserScan

# Told of a scan whose pitch is known, the clouds that are complete with it, and its odometry.
OnMade = Callable[[Scan, list[Points], Odometry | None], None]


class OdometrySource(Protocol):
    """Where odometry comes from."""

    @property
    def history(self) -> OdometryHistory:
        """What has come."""

    @property
    def trouble(self) -> str:
        """Why nothing has, in words; empty if there is no trouble."""

    def register(self, on_sample: Callable[[], None], on_time_back: Callable[[], None]) -> None:
        """Set what is called after each new sample, and when time went back."""


class ScanToCloud:
    """Makes clouds of scans, joint states and odometry as the parameters say.

    Parameters
    ----------
    config
        Parameters of the assembler.
    scans, states
        Filters whose messages are well-formed LaserScans, and JointStates.
    odometry
        Needed unless ego_motion is off.
    now_ns
        The clock by which scans wait [ns].
    on_made
        What is made is given to it.
    warn
        Told in words of what is dropped or not compensated.

    Attributes
    ----------
    drops
        Scans and joint states that were dropped, counted by reason.
    pipeline
        Tells of the last scan's beams and pitch.
    joint, odometry
        What comes of the joint states, and where odometry comes from.
    """

    def __init__(
        self,
        config: AssemblerConfig,
        scans: SimpleFilter,
        states: SimpleFilter,
        odometry: OdometrySource | None,
        now_ns: Callable[[], int],
        on_made: OnMade,
        warn: Callable[[str], None] = lambda text: None,
    ) -> None:
        self.drops: Counter[str] = Counter()
        self._otherwise: Counter[str] = Counter()
        self.pipeline = Pipeline.configured(config)
        self._config, self.odometry = config, odometry
        self._on_made, self._warn = on_made, warn
        self.joint = JointFilter(states, config, self.drops)
        self.joint.registerCallback(self.pipeline.add_sample)
        bracket = BracketFilter(
            scans,
            self.joint,
            self._duration_ns,
            config.deadline,
            now_ns,
            lambda scan, reason: self.drop(reason, self.aside),
            self.pipeline.estimator.margin_ns,
        )
        self._waiting: list[BracketFilter | OdometryFilter] = [bracket]
        if odometry is not None:
            self._waiting.append(self._with(odometry, bracket, now_ns))
        self._waiting[-1].registerCallback(self._assemble)
        # Not by a timer: waking up costs a node more than a cloud does.
        self.joint.registerCallback(lambda *sample: self.release())

    def _with(
        self, odometry: OdometrySource, bracket: BracketFilter, now_ns: Callable[[], int]
    ) -> OdometryFilter:
        """Return what waits for odometry, after the joint samples."""
        config = self._config
        waiting = OdometryFilter(
            bracket,
            odometry.history,
            self._duration_ns,
            config.deadline,
            now_ns,
            self._odometry_missing,
        )
        odometry.register(waiting.release, waiting.forget)
        return waiting

    def restart(self, reason: str) -> None:
        """Begin anew, dropping what waits for a reason: the clock was set."""
        self.joint.restart()
        if self.odometry is not None:
            self.odometry.history.clear()
        for waiting in self._waiting:
            waiting.forget(reason)
        self.pipeline.restart()

    @property
    def joint_name(self) -> str:
        """The joint that nods."""
        return self._config.joint_name

    @property
    def remarks(self) -> dict[str, int]:
        """How many scans were made otherwise than asked for, by what was done and the reason."""
        fallbacks = self.pipeline.estimator.fallbacks
        return {
            **self._otherwise,
            **{f'slerp instead of trajectory: {reason}': n for reason, n in fallbacks.items()},
        }

    @property
    def aside(self) -> str:
        """Why joint samples or odometry never came, in parentheses; empty if they did."""
        if self.joint.trouble:
            return f' ({self.joint.trouble})'
        tf = self.odometry.trouble if self.odometry is not None else ''
        return f' (TF: {tf})' if tf else ''

    def release(self) -> None:
        """Let go what has waited for too long, as each scan and joint state does.

        Call it now and then where neither may come.
        """
        for waiting in self._waiting:
            waiting.release()

    def drop(self, reason: str, detail: str = '') -> None:
        """Count a scan that is dropped; the detail is only told."""
        self.drops[reason] += 1
        self._warn(f'scan dropped: {reason}{detail}')

    def _duration_ns(self, scan: LaserScan) -> int:
        return self.pipeline.beams(geometry_from_message(scan)).duration_ns

    def _assemble(
        self, scan: LaserScan, samples: JointSamples, odometry: Odometry | None = None
    ) -> None:
        told = scan_from_message(scan)
        try:
            clouds = self.pipeline.add_scan(told, *samples, odometry)
        except PitchError as error:
            self.drop(str(error))
        except OdometryError as error:
            self._odometry_missing(scan, samples, error.reason)
        else:
            if told.geometry.time_increment == 0.0:
                self._otherwise['all beams of one instant: time_increment is 0'] += 1
            self._on_made(told, clouds, odometry)

    def _odometry_missing(self, scan: LaserScan, samples: JointSamples, reason: str) -> None:
        if self._config.without_odometry == 'drop':
            self.drop(reason, self.aside)
            return
        self._otherwise[f'uncompensated: {reason}'] += 1
        self._warn(f'motion not compensated: {reason}{self.aside}')
        self._assemble(scan, samples)

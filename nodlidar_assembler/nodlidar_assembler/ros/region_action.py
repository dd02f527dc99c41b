"""The action ~/scan_region: takes the nod over until a region is seen, and gives it back."""

from collections.abc import Callable

from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.region_plan import Region, region_plan, RegionError
from nodlidar_assembler.control.region_scan import RegionScan
from nodlidar_assembler.ros.cloud_message import cloud_message
from nodlidar_assembler.ros.coverage_report import fill_coverage
from nodlidar_assembler.ros.nod_publisher import NodPublisher
from nodlidar_common.errors import NodlidarError
from nodlidar_common.ros.polled import PolledSubscription
from nodlidar_common.ros.qos import SERVICE
from nodlidar_common.ros.steady import create_steady_timer
from nodlidar_common.survival import Survival
from nodlidar_msgs.action import ScanRegion
from nodlidar_msgs.msg import NodStatus
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Future

FEEDBACK_PERIOD = 0.5  # s
# Results are kept for this time [s]: they have clouds, and clients ask for them at once.
RESULT_TIMEOUT = 60


class RegionAction:
    """Scans the regions of goals, one at a time.

    A goal that cannot be scanned is accepted and aborted at once: the refusal of an action has no
    room for the reason.

    Parameters
    ----------
    node, config
        The assembler, and its parameters.
    nod
        Commands the nod; None if it is not commanded here.
    frame_id
        Returns the frame of points, given whether they are in odometry.
    survival
        Catches errors of the timer.
    """

    def __init__(
        self,
        node: Node,
        config: AssemblerConfig,
        nod: NodPublisher | None,
        frame_id: Callable[[Points, bool], str],
        survival: Survival,
    ) -> None:
        self._node, self._config, self._nod = node, config, nod
        self._frame_id, self._survival = frame_id, survival
        self._scan: RegionScan | None = None
        self._goal: ServerGoalHandle | None = None  # for which it scans
        self._over: Future[None] = Future()
        self._stated_limits: tuple[float, float] | None = None
        self._server = ActionServer(
            node,
            ScanRegion,
            '~/scan_region',
            self._execute,
            cancel_callback=self._cancel,
            goal_service_qos_profile=SERVICE,
            result_service_qos_profile=SERVICE,
            cancel_service_qos_profile=SERVICE,
            result_timeout=RESULT_TIMEOUT,
        )
        self._statuses = PolledSubscription(node, NodStatus, 'servo/status', QoSProfile(depth=1))

    @property
    def is_busy(self) -> bool:
        """Whether a goal runs."""
        return self._scan is not None

    @property
    def pitch_limits(self) -> tuple[float, float]:
        """Limits of the mount [rad]: as the servo states them, or else the configured ones."""
        return self.stated_limits or (self._config.pitch_min, self._config.pitch_max)

    @property
    def stated_limits(self) -> tuple[float, float] | None:
        """Limits of the mount [rad] as the servo states them; None before it did."""
        for status in self._statuses.take():
            lower, upper = status.pitch_lower_limit, status.pitch_upper_limit
            if lower < upper:
                self._stated_limits = self._config.joint_axis.pitches(lower, upper)
        return self._stated_limits

    def reconfigure(self, config: AssemblerConfig) -> None:
        """Use other parameters for the next goals."""
        self._config = config

    def add(self, assembled: Assembled) -> None:
        """Add a scan to the region that is being scanned, if there is one."""
        if self._scan is not None:
            self._scan.add(assembled)
            self._check()

    def destroy(self) -> None:
        """Remove the action from ROS."""
        self._server.destroy()

    def end(self, message: str) -> None:
        """End the goal for a reason, if there is one."""
        if self._scan is not None and self._nod is not None:
            self._scan.end(message, self._nod.now_ns())
            self._check()

    def clock_was_set(self) -> None:
        """End the goal, if there is one, with its last beam: by the new time, it did not begin."""
        if self._scan is not None:
            self._scan.end('the clock was set', 0)
            self._check()

    def _check(self) -> None:
        """Give the nod back as soon as the scan is over."""
        if self._scan is not None and self._scan.is_over and not self._over.done():
            if self._nod is not None:
                self._nod.give_back()
            self._over.set_result(None)

    def _cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        if goal is self._goal:  # not one that is about to be refused
            self.end('cancelled')
        return CancelResponse.ACCEPT

    async def _execute(self, goal: ServerGoalHandle) -> ScanRegion.Result:
        """Scan the region of a goal."""
        if goal.is_cancel_requested:
            goal.canceled()
            return ScanRegion.Result(message='cancelled')
        try:
            scan = self._begin(goal.request)
        except NodlidarError as error:
            self._node.get_logger().warning(f'scan_region refused: {error}')
            goal.abort()
            return ScanRegion.Result(message=f'refused: {error}')
        self._goal = goal
        report = self._survival.guarded(lambda: self._report(goal, scan))
        timer = create_steady_timer(self._node, FEEDBACK_PERIOD, report)
        await self._over
        self._node.destroy_timer(timer)
        self._scan = self._goal = None
        result = self._result(scan)
        if goal.is_cancel_requested:
            goal.canceled()
        elif scan.success:
            goal.succeed()
        else:
            goal.abort()
        return result

    def _begin(self, goal: ScanRegion.Goal) -> RegionScan:
        """Take the nod over for a goal; raise NodlidarError if that is not possible."""
        if self._scan is not None:
            raise RegionError('another region is being scanned')
        if self._nod is None:
            raise RegionError('the nod is not commanded by this node: command_nod is false')
        if self._nod.silent:
            raise RegionError('no scans arrive')
        if getattr(self._node, 'successor', None) is not None:
            raise RegionError('another profile takes over')
        keys = Region.__dataclass_fields__
        region = Region(**{key: getattr(goal, key) for key in keys})
        view = self._nod.controller.view
        plan = region_plan(region, view.config, view.task, self.pitch_limits, view.step)
        start_ns = self._nod.now_ns()
        begin_ns = self._nod.take_over(plan.shape)
        try:
            self._scan = RegionScan(plan, start_ns, begin_ns, self._config.deskew_to)
        except NodlidarError:
            self._nod.give_back()
            raise
        self._over = Future()
        self._node.get_logger().info(
            f'scanning {plan.task.cells} cells, for {self._scan.predicted_time:.1f} s by the plan'
        )
        return self._scan

    def _report(self, goal: ServerGoalHandle, scan: RegionScan) -> None:
        """Publish the feedback, and end the goal if its time is over or the nod was lost."""
        assert self._nod is not None
        now_ns = self._nod.now_ns()
        scan.check(now_ns)
        if not self._nod.controller.taken_over:
            scan.end('another lidar than at the start sends scans', now_ns)
        self._check()
        progress = scan.progress(now_ns)
        goal.publish_feedback(
            ScanRegion.Feedback(
                seen=progress.seen,
                largest_hole=progress.largest_hole,
                time_to_go=progress.time_to_go,
            )
        )

    def _result(self, scan: RegionScan) -> ScanRegion.Result:
        result = ScanRegion.Result(
            success=scan.success,
            message=scan.message,
            duration=scan.duration,
            predicted_time=scan.predicted_time,
        )
        coverage = result.coverage
        coverage.window, coverage.cell = scan.duration, scan.cell
        coverage.time_to_see_all = scan.duration if scan.success else float('nan')
        coverage.header.stamp = self._node.get_clock().now().to_msg()
        coverage.header.frame_id = self._config.frame_id
        fill_coverage(coverage, scan.covered)
        points = scan.points
        if points is not None:
            result.cloud = cloud_message(points, self._frame_id(points, scan.in_odometry))
        return result

"""The lifecycle node of a joint that ros2_control moves: nod commands in, trajectories out."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
import math
import sys
import time
from typing import Any, TypeGuard

from nodlidar_common.dynamics import cruising_speed
from nodlidar_common.errors import DeviceError
from nodlidar_common.nod import Nod
from nodlidar_common.ros.node import run
from nodlidar_common.ros.polled import PolledSubscription
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S, time_ns
from nodlidar_common.tracking import Drive, NodProgress, NodTracker
from nodlidar_servo.joint_trajectory.joint_sample import (
    JointSample,
    JointSampleFilter,
    JointStamps,
    StampError,
)
from nodlidar_servo.joint_trajectory.nod_offset import NodOffset
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_servo.joint_trajectory.trajectory_diagnosis import OffNod, TrajectoryDiagnosis
from nodlidar_servo.joint_trajectory.waypoints import HELD, is_within, Planner
from nodlidar_servo.nod.nod_commands import NodCommands
from nodlidar_servo.ros.nod_node import NodNode
from nodlidar_servo.ros.trajectory_message import trajectory_message
from rclpy.duration import Duration
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

MOST_STATES = 500  # kept between two trajectories; half a second of a controller at 1 kHz
_PATIENCE = 5.0  # s for the controllers to start, often after this node; then that is an error
# So long between two cycles, this process did not run: it was stopped, or the host was busy [s].
_STOOD_STILL = 0.3
_CATCHING_UP = 0.5  # s; then what came meanwhile has been taken


def add_state(
    message: JointState,
    joint_name: str,
    samples: JointSampleFilter,
    believe: Callable[[int], bool],
) -> JointSample | None:
    """Add the measurement of a joint to its samples; return it, None if it is not added.

    Its stamp [ns] must be believed.
    """
    stamp_ns = time_ns(message.header.stamp)
    if joint_name not in message.name or not believe(stamp_ns):
        return None
    index = message.name.index(joint_name)
    return samples.add(stamp_ns, _value(message.position, index), _value(message.velocity, index))


def _value(values: Sequence[float], index: int) -> float:
    """Return a value of a joint state; NaN if it is missing."""
    return values[index] if index < len(values) else math.nan


class TrajectoryNode(NodNode):
    """Sends the nod to a joint_trajectory_controller; publishes `~/status`.

    The controller takes the place of a device: connected is the node while the controller listens
    and joint states arrive.
    """

    def __init__(self) -> None:
        super().__init__(TrajectoryConfig)
        self._trajectory: Any = None  # its topic is a parameter
        self.configure()
        kept = QoSProfile(depth=MOST_STATES, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._joint_states = PolledSubscription(self, JointState, 'joint_states', kept)

    def configure(self) -> None:
        """Forget all commands: the limits may have changed, and the controller."""
        if self._trajectory is not None:
            self.destroy_publisher(self._trajectory)
        topic = f'{self.config.controller}/joint_trajectory'
        self._trajectory = self.create_publisher(
            JointTrajectory, topic, 1, qos_overriding_options=OVERRIDABLE
        )
        self.commands = NodCommands(self.config)
        self._planner = Planner(self.config.dynamics, self.config.pitch_limits)
        self._samples = JointSampleFilter(self.config.dynamics)
        self._arrived_ns = self._cycled_ns = self._caught_up_ns = 0
        self._heard = False  # since the last pause
        self._stamps = JointStamps(self.config.joint_timeout)
        self._stamp_error, self._taken_ns = StampError(), 0
        self._is_moving = False
        self._off_nod, self._offset = OffNod(), NodOffset()
        self.diagnosis: TrajectoryDiagnosis = TrajectoryDiagnosis(self.commands)

    def connect(self) -> None:
        """Wait for the controller and the first joint state."""
        deadline_ns = steady_ns() + round(_PATIENCE * NS_PER_S)
        self._joint_states.take()  # what came meanwhile is old by now
        self._stamps.restart()
        self._samples.restart()
        while self.thread.keep_going() and steady_ns() < deadline_ns and self._may_come():
            time.sleep(1.0 / self.config.send_rate)
            self._new_samples()
        self._check()
        self._cycled_ns = steady_ns()

    def cycle(self) -> None:
        """Send the nod from the present leg on, or stop the joint without a command."""
        time.sleep(1.0 / self.config.send_rate)
        self._note_a_pause()
        samples = self._new_samples()
        self._check()
        latest = self._samples.latest
        assert latest is not None
        if steady_ns() < self._caught_up_ns and not self._is_recent(latest):
            return
        tracker = self.commands.follow(steady_ns(), self.start_clock_ns())
        if tracker is None:
            self._stop()
            self._off_nod = OffNod()
            self._offset.restart()
            self._show(len(samples), None, None)
            return
        cruise = cruising_speed(tracker.nod, self.config.acceleration)
        for sample in samples:
            tracker.measure_phase(sample)
            self._offset.add(tracker.nod, sample, cruise)
        self._send(tracker, latest)
        self._show(len(samples), self._progress(tracker), self._follow_by(tracker, latest))

    def disconnect(self) -> None:
        """Stop the joint."""
        self._stop()
        self._show(0, None, None)

    def _send(self, tracker: NodTracker, sample: JointSample) -> None:
        now_ns = self.now_ns()
        after = self._next(tracker, now_ns)
        waypoints = self._planner.plan(tracker.led, sample, now_ns, after)
        self._trajectory.publish(trajectory_message(self.config.joint_name, waypoints))
        self._is_moving = True

    def _next(self, tracker: NodTracker, now_ns: int) -> tuple[Nod, int] | None:
        """Return the nod after the present one and its start [ns], both led; None if unknown."""
        found = self.commands.next(steady_ns())
        if found is None:
            return None
        nod, start_ns = found
        return tracker.lead(nod), start_ns - self.start_clock_ns() + now_ns - tracker.phase.lead_ns

    def _stop(self) -> None:
        # Without a recent sample within the mount the latest plan holds: it ends at rest at a
        # reversal.
        sample, limits = self._samples.latest, self.config.pitch_limits
        if self._is_moving and self._is_recent(sample) and is_within(sample, limits):
            held = self._planner.hold(sample, self.now_ns())
            self._trajectory.publish(trajectory_message(self.config.joint_name, held))
            # What is on its way when a node ends may be lost. Not every middleware can wait.
            with suppress(RuntimeError):
                self._trajectory.wait_for_all_acked(Duration(seconds=HELD))
        self._is_moving = False

    def _may_come(self) -> bool:
        """Return whether the controller or joint states are missing, and nothing else is wrong."""
        is_there = self._samples.latest is not None and self._trajectory.get_subscription_count()
        return not is_there and not self._stamps.trouble

    def _check(self) -> None:
        """Raise DeviceError without a controller or joint states, or if their stamps are wrong."""
        if not self._trajectory.get_subscription_count():
            raise DeviceError(f"no controller listens on '{self._trajectory.topic_name}'")
        age, timeout = (steady_ns() - self._arrived_ns) / NS_PER_S, self.config.joint_timeout
        if self._stamps.trouble:
            raise DeviceError(f"joint states of '{self.config.joint_name}' {self._stamps.trouble}")
        if self._samples.latest is None or age > timeout:
            raise DeviceError(f"no joint states of '{self.config.joint_name}' for {timeout:g} s")

    def _is_recent(self, sample: JointSample | None) -> TypeGuard[JointSample]:
        """Return whether there is a sample of the last joint_timeout."""
        timeout: float = self.config.joint_timeout
        return sample is not None and abs(self.now_ns() - sample.stamp_ns) <= timeout * NS_PER_S

    def _note_a_pause(self) -> None:
        """Wait for new joint states if this process did not run for a while.

        Those that came meanwhile are late by no fault of a clock, and arrive one after the other.
        """
        before_ns, self._cycled_ns = self._cycled_ns, steady_ns()
        longest = _STOOD_STILL + 1.0 / self.config.send_rate
        # Once: else a host that is always busy would never miss them.
        if self._heard and self._cycled_ns - before_ns > longest * NS_PER_S:
            self._caught_up_ns = self._cycled_ns + round(_CATCHING_UP * NS_PER_S)
            self._arrived_ns, self._heard = self._cycled_ns, False

    def _new_samples(self) -> list[JointSample]:
        """Return the measurements since the last call; the last one is kept."""
        before_ns, self._taken_ns = self._taken_ns, self.now_ns()
        samples, came_ns = [], 0
        for message, arrived_ns in self._joint_states.take_with_arrival():
            sample = add_state(message, self.config.joint_name, self._samples, self._is_of_now)
            if sample is not None:
                samples.append(sample)
                came_ns = arrived_ns
                self._arrived_ns, self._heard = steady_ns(), True
        if samples:
            age_ns, since_ns = self._taken_ns - samples[-1].stamp_ns, self._taken_ns - before_ns
            if came_ns and not self.get_clock().ros_time_is_active:
                since_ns = min(since_ns, max(time.time_ns() - came_ns, 0))
            self._stamp_error.add(age_ns / NS_PER_S, since_ns / NS_PER_S)
        return samples

    def _is_of_now(self, stamp_ns: int) -> bool:
        now_ns = self.now_ns()
        late = (now_ns - stamp_ns) / NS_PER_S
        if steady_ns() < self._caught_up_ns and late > self.config.joint_timeout:
            return False
        return self._stamps.believe(stamp_ns, now_ns)

    def _progress(self, tracker: NodTracker) -> NodProgress:
        speed = cruising_speed(tracker.nod, self.config.acceleration)
        return replace(tracker.progress(), drive=Drive(math.nan, speed, False))

    def _follow_by(self, tracker: NodTracker, sample: JointSample) -> int | None:
        follows = self._planner.follows(tracker.led, sample)
        return self._off_nod.follow_by(follows, steady_ns(), tracker.nod.sweep_duration)

    def _show(self, samples: int, progress: NodProgress | None, follow_by_ns: int | None) -> None:
        state = self.diagnosis.state
        latest, limits = self._samples.latest, self.config.pitch_limits
        self.diagnosis.state = replace(
            state,
            samples=state.samples + samples,
            refused=self._stamps.refused,
            impossible=self._samples.refused,
            stamp_error=self._stamp_error.seconds,
            offset=self._offset.radians,
            pitch=math.nan if latest is None else latest.pitch,
            is_outside=latest is not None and not is_within(latest, limits),
            progress=progress,
            follow_by_ns=follow_by_ns,
        )
        self.publish_status(progress)

    def now_ns(self) -> int:
        """Return the time of the node's clock [ns], the simulator's with use_sim_time."""
        return int(self.get_clock().now().nanoseconds)

    def start_clock_ns(self) -> int:
        """Return the same if it is simulated: it may pass at any rate. A host's may be set."""
        clock = self.get_clock()
        return self.now_ns() if clock.ros_time_is_active else super().start_clock_ns()


def main() -> None:
    """Run the node."""
    sys.exit(run(TrajectoryNode))

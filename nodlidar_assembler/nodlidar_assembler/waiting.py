"""Scans that wait, in the order in which they came, for what they need."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from nodlidar_assembler.clouds.pipeline import PipelineConfig
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter

MOST_WAITING = 1000
"""More do not wait: the longest deadline has a hundred scans a second do so."""

Waiting = TypeVar('Waiting')
Found = TypeVar('Found')


EGO_MOTION_MODES = ('off', 'beam')
WITHOUT_ODOMETRY = ('drop', 'uncompensated')


@dataclass(frozen=True)
class WaitingConfig(PipelineConfig):
    """Waiting for what brackets a scan, and ego-motion."""

    frame_id: str = parameter(
        'nodlidar_base_link',
        'Frame of the clouds: it does not nod; origin on the nod axis, x forward, z up',
    )
    deadline: float = parameter(
        0.3,
        'Longest time that a scan waits for joint samples, and then again for odometry',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )
    ego_motion: str = parameter(
        'off',
        'off: clouds in frame_id; beam: clouds in odom_frame, every beam from the pose of the '
        'robot at its instant, by odometry from TF',
        choices=EGO_MOTION_MODES,
    )
    odom_frame: str = parameter(
        'odom',
        'Frame of odometry: TF has the pose of frame_id in it',
    )
    without_odometry: str = parameter(
        'drop',
        'What happens to a scan without odometry: drop, or uncompensated (its cloud is in '
        'frame_id; not with clouds per sweep)',
        choices=WITHOUT_ODOMETRY,
    )

    def check_together(self) -> None:
        """Raise ParameterError for frames and modes that exclude each other."""
        if self.ego_motion == 'off':
            return
        if self.odom_frame in ('', self.frame_id):
            limit = f"a frame other than frame_id = '{self.frame_id}'"
            raise ParameterError('odom_frame', limit, self.odom_frame)
        if self.cloud_mode == 'sweep' and self.without_odometry != 'drop':
            limit = 'drop with clouds per sweep, whose points are in one frame'
            raise ParameterError('without_odometry', limit, self.without_odometry)


class WaitingLine(Generic[Waiting, Found]):
    """Whatever waits leaves in the order in which it came.

    Parameters
    ----------
    deadline_ns
        Longest wait [ns].
    """

    def __init__(self, deadline_ns: int) -> None:
        self._deadline_ns = deadline_ns
        self._waiting: deque[tuple[int, Waiting]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, waiting: Waiting, now_ns: int) -> None:
        """Let something wait from an instant [ns] on."""
        self._waiting.append((now_ns, waiting))

    def leave(
        self, now_ns: int, find: Callable[[Waiting, bool], Found | None]
    ) -> Iterator[tuple[Waiting, Found]]:
        """Yield what leaves at an instant [ns], with what was found for it.

        Parameters
        ----------
        now_ns
            The instant, by the clock of `add`.
        find
            Given what waits, and whether it is overdue: returns what was found for it, or None
            if it is to wait on, which it may not if it is overdue.
        """
        while self._waiting:
            is_full = len(self._waiting) > MOST_WAITING
            # Taken out first: a scan that makes something fail must not do so again and again.
            since_ns, waiting = first = self._waiting.popleft()
            # A clock that was set back makes the wait negative; it must not become an endless one.
            in_time = 0 <= now_ns - since_ns <= self._deadline_ns
            found = find(waiting, is_full or not in_time)
            if found is None:
                self._waiting.appendleft(first)
                return
            yield waiting, found

    def clear(self) -> list[Waiting]:
        """Let all leave; return them."""
        left = [waiting for _, waiting in self._waiting]
        self._waiting.clear()
        return left

"""Scans that wait for joint samples and odometry, in the order of arrival."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from nodlidar_assembler.clouds.pipeline import PipelineConfig
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter

# The longest deadline of 10 s at a hundred scans per second.
MOST_WAITING = 1000

Waiting = TypeVar('Waiting')
Found = TypeVar('Found')

WITHOUT_ODOMETRY = ('drop', 'uncompensated')


@dataclass(frozen=True)
class WaitingConfig(PipelineConfig):
    """Waiting for joint samples and odometry, and ego-motion."""

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
    """A queue with a deadline, released in the order of arrival.

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
        """Add an item that waits from an instant [ns] on."""
        self._waiting.append((now_ns, waiting))

    def release(
        self, now_ns: int, find: Callable[[Waiting, bool], Found | None]
    ) -> Iterator[tuple[Waiting, Found]]:
        """Yield the items that wait no longer, with the result of `find` for each.

        Parameters
        ----------
        now_ns
            Current time, by the clock of `add` [ns].
        find
            Function of an item and whether it is overdue. Returns the result for the item, or
            None if it must wait longer, which an overdue item cannot.
        """
        while self._waiting:
            is_full = len(self._waiting) > MOST_WAITING
            # Removed first, so that an item for which `find` raises does not block the queue.
            since_ns, waiting = first = self._waiting.popleft()
            # The wait is negative after the clock was set back, and would not end in time.
            in_time = 0 <= now_ns - since_ns <= self._deadline_ns
            found = find(waiting, is_full or not in_time)
            if found is None:
                self._waiting.appendleft(first)
                return
            yield waiting, found

    def clear(self) -> list[Waiting]:
        """Remove and return all items."""
        removed = [waiting for _, waiting in self._waiting]
        self._waiting.clear()
        return removed

"""The map: drawn from time to time, saved and loaded, in a thread of its own."""

from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
import traceback
from typing import Any

from nav_msgs.msg import OccupancyGrid
from nav_msgs.msg import Path as PathMessage
from nodlidar_common.command_line import in_words
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.ros.qos import OVERRIDABLE, SERVICE
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S
from nodlidar_mapper.background import Background
from nodlidar_mapper.config import MapperConfig
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.live import LiveMapper
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.output.grid import EmptyMapError, surface_and_grid
from nodlidar_mapper.output.map_folder import load, save
from nodlidar_mapper.ros import messages
from nodlidar_mapper.ros.kept_map import KeptMap
from nodlidar_msgs.srv import MapFolder
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import PointCloud2

SHARE = 0.2  # of the time that drawing may take


class MapOutput:
    """Publishes the map, and answers the services that save and load it.

    Parameters
    ----------
    node, config
        Owner of publishers and services.
    on_load
        Called with the mapper of a map that was loaded.

    Attributes
    ----------
    kept
        The map in save_folder.
    snapshot
        What is known after the last cloud; None without any.
    unanswered
        Number of requests that were not answered yet.
    """

    def __init__(
        self, node: Node, config: MapperConfig, on_load: Callable[[LiveMapper], None]
    ) -> None:
        self._config, self._on_load, self._log = config, on_load, node.get_logger()
        self.kept = KeptMap(config, self._log)
        self.snapshot: MapSnapshot | None = None
        self.unanswered = 0
        self._thread = Background()
        self._requests: deque[tuple[Callable[[], Any], Callable[[Any], None]]] = deque()
        self._draw_after_ns = 0
        self._drawn: Sequence[Keyframe] = []  # another list for another map
        self._publishers = [
            node.create_publisher(
                kind,
                topic,
                QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL),
                qos_overriding_options=OVERRIDABLE,
            )
            for kind, topic in (
                (PathMessage, 'path'),
                (PointCloud2, 'map_cloud'),
                (OccupancyGrid, 'map'),
            )
        ]
        # A service that awaits its thread would otherwise block the other callbacks.
        group = ReentrantCallbackGroup()
        for name, answer in (('save_map', self._save), ('load_map', self._load)):
            node.create_service(
                MapFolder, f'~/{name}', answer, qos_profile=SERVICE, callback_group=group
            )

    def begin(self) -> None:
        """Let another map begin: the one that was drawn is saved if wanted, and forgotten."""
        self.kept.begin(self.snapshot)
        self.snapshot, self._draw_after_ns, self._drawn = None, 0, []

    def step(self) -> None:
        """Take what is ready, and start what is next; raise what failed."""
        self.kept.step(self.snapshot)
        self._thread.deliver()
        if self._thread.busy:
            return
        if self._requests:
            self._thread.start(*self._requests.popleft())
        elif self.snapshot is not None and steady_ns() >= self._draw_after_ns:
            self._draw(self.snapshot)

    def end(self) -> None:
        """Save the map where save_folder wants it; do what was asked for, too late to answer."""
        self.kept.end(self.snapshot)
        self._thread.end()
        while self._requests:
            attempt, _ = self._requests.popleft()
            if isinstance(result := attempt(), Exception):
                self._log.error(f'a request for a map failed: {in_words(result)}')

    def _draw(self, snapshot: MapSnapshot) -> None:
        """Publish the path and, if it has changed, the map."""
        begin_ns, config = steady_ns(), self._config
        before = self._drawn
        same = before == snapshot.keyframes
        # A failure must not be repeated at once.
        self._draw_after_ns = begin_ns + round(config.map_period * NS_PER_S)

        def draw() -> tuple[Any, ...]:
            at = snapshot.estimate.stamp_ns, config.map_frame
            path = messages.path_message(snapshot.stamps_ns, snapshot.path, *at)
            if same:
                return (path,)
            try:
                surface, grid = surface_and_grid(snapshot.keyframes, config)
            except EmptyMapError:
                return (path,)
            return path, messages.surface_message(surface, *at), messages.grid_message(grid, *at)

        def publish(found: tuple[Any, ...]) -> None:
            if self._drawn is not before:
                return  # another map was begun meanwhile
            now_ns = steady_ns()
            pause_ns = round((now_ns - begin_ns) * (1.0 / SHARE - 1.0))
            self._draw_after_ns = max(self._draw_after_ns, now_ns + pause_ns)
            self._drawn = snapshot.keyframes
            for publisher, message in zip(self._publishers, found, strict=False):
                publisher.publish(message)

        self._thread.start(draw, publish)

    # Services.

    async def _save(
        self, request: MapFolder.Request, response: MapFolder.Response
    ) -> MapFolder.Response:
        """Save the map as it is now."""
        snapshot = self.snapshot
        return await self._answered(
            response, lambda: save(_folder(request), snapshot, self._config), str
        )

    async def _load(
        self, request: MapFolder.Request, response: MapFolder.Response
    ) -> MapFolder.Response:
        """Continue with a saved map, in which the robot may be anywhere."""

        def loaded(mapper: LiveMapper) -> str:
            self._on_load(mapper)
            return f'{len(mapper.mapper.map.keyframes)} keyframes loaded'

        def job() -> LiveMapper:
            return LiveMapper(Mapper(self._config, *load(_folder(request))))

        return await self._answered(response, job, loaded)

    async def _answered(
        self, response: MapFolder.Response, job: Callable[[], Any], then: Callable[[Any], str]
    ) -> MapFolder.Response:
        """Answer a request with the result of a job, or why it failed."""
        done: Future[Any] = Future()

        def attempt() -> Any:
            try:
                return job()
            except (NodlidarError, OSError) as error:
                return error
            except Exception as error:
                cause = ''.join(traceback.format_exception(error))
                self._log.error(f'unexpected error of a request for a map:\n{cause}')
                name = type(error).__name__
                return NodlidarError(f'internal error, {name}: {error} (see the log)')

        self._requests.append((attempt, done.set_result))
        self.unanswered += 1
        result = await done
        self.unanswered -= 1
        response.success = not isinstance(result, Exception)
        response.message = then(result) if response.success else in_words(result)
        return response


def _folder(request: MapFolder.Request) -> Path:
    if not request.folder:
        raise ParameterError('folder', 'the path of a folder', request.folder)
    return Path(request.folder)

"""The three-dimensional part of the page: cloud, scan, robot, map and path."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from nodlidar_common.arrays import Array
from nodlidar_common.pose import Pose
from nodlidar_viewer.colours import HeightColours, of_age
from nodlidar_viewer.recent_points import Chunk
from nodlidar_viewer.robot_model import Shape
import numpy as np
from numpy.typing import NDArray
from viser import MeshHandle, PointCloudHandle, SceneApi, SceneNodeHandle

Points = NDArray[np.float32]

POINT_SIZE = 0.015  # m
FLOOR = 10  # m from its middle, with a line every metre
FLOOR_COLOUR, FIFTH_COLOUR = (215, 215, 215), (180, 180, 180)
MAP_COLOUR = (150, 155, 165)
PATH_COLOUR = (230, 90, 30)
FAN_COLOUR = (90, 170, 255)
BY_HEIGHT, BY_AGE = 'height', 'age'


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """A chunk, how it is coloured, and what viser made of it."""

    chunk: Chunk
    colouring: str
    cloud: PointCloudHandle


class Scene:
    """Draws into viser's scene what has changed.

    Parameters
    ----------
    scene
        Of the server: all browsers see the same.

    Attributes
    ----------
    colour_by
        BY_HEIGHT or BY_AGE.
    """

    def __init__(self, scene: SceneApi) -> None:
        self._scene = scene
        self.colour_by = BY_HEIGHT
        self._heights = HeightColours()
        self._drawn: dict[int, _Drawn] = {}
        self._free_names: deque[str] = deque()  # viser remembers each name that was removed
        self._fan: MeshHandle | None = None
        self._links: dict[str, tuple[SceneNodeHandle, Pose | None]] = {}  # with where they are
        # Without a graphics card, shadows and reflections take longer than all else.
        scene.configure_default_lights(cast_shadow=False)
        scene.configure_environment_map(None)
        # So does viser's grid, which computes each pixel of the floor.
        lines, colours = _floor()
        scene.add_line_segments('/floor', lines, colours, thickness=1.0, thickness_units='screen')

    def show_cloud(self, chunks: Sequence[Chunk]) -> None:
        """Draw the chunks that have changed, and remove those that are not there any more.

        To be called within `Page.at_once`, as points and their colours are sent one by one.
        """
        numbers = {chunk.number for chunk in chunks}
        for number in self._drawn.keys() - numbers:
            cloud = self._drawn.pop(number).cloud
            self._free_names.append(cloud.name)
            cloud.remove()
        if not chunks:
            return
        is_stale = not numbers <= self._drawn.keys() and self._heights.fit(
            np.concatenate([chunk.points[::8, 2] for chunk in chunks])
        )
        for place, chunk in enumerate(reversed(chunks)):
            colouring = self.colour_by
            if colouring == BY_AGE:
                colouring += f' {place / len(chunks):.2f}'
            drawn = self._drawn.get(chunk.number)
            is_same = drawn and drawn.chunk is chunk and drawn.colouring == colouring
            if is_stale or not is_same:
                cloud = self._draw(chunk, place / len(chunks), drawn)
                self._drawn[chunk.number] = _Drawn(chunk, colouring, cloud)

    def _draw(self, chunk: Chunk, age: float, drawn: _Drawn | None) -> PointCloudHandle:
        """Draw a chunk, or change what is drawn of it, which takes viser a third of the time."""
        heights = chunk.points[:, 2]
        colours = np.array(of_age(age)) if self.colour_by == BY_AGE else self._heights.of(heights)
        if drawn is not None and len(drawn.chunk.points):
            drawn.cloud.points = chunk.points - drawn.cloud.position.astype(np.float32)
            drawn.cloud.colors = colours
            return drawn.cloud
        # Counted from their mean, as the browser gets coordinates of 16 bits.
        middle = chunk.points.mean(axis=0) if len(chunk.points) else np.zeros(3, dtype=np.float32)
        return self._scene.add_point_cloud(
            self._new_name() if drawn is None else drawn.cloud.name,
            chunk.points - middle,
            colours,
            position=middle,
            point_size=POINT_SIZE,
            point_shading='flat',
        )

    def _new_name(self) -> str:
        return self._free_names.popleft() if self._free_names else f'/cloud/{len(self._drawn)}'

    def show_fan(self, vertices: Points, triangles: NDArray[np.uint32], pose: Pose) -> None:
        """Draw the scan plane: vertices in the frame of the lidar, and its pose."""
        if self._fan is None:
            self._fan = self._scene.add_mesh_simple(
                '/scan',
                vertices,
                triangles,
                color=FAN_COLOUR,
                opacity=0.35,
                material='toon3',  # without a graphics card, the standard one takes twice as long
                side='double',
                cast_shadow=False,
                receive_shadow=False,
            )
        self._fan.vertices, self._fan.faces = vertices, triangles
        self._fan.wxyz, self._fan.position = _wxyz(pose), pose.position

    def show_model(self, shapes: Sequence[Shape]) -> None:
        """Draw a robot model anew."""
        self._scene.remove_by_name('/robot')
        self._links = {
            link: (self._scene.add_frame(f'/robot/{link}', show_axes=False, visible=False), None)
            for link in {shape.link for shape in shapes}
        }
        for index, shape in enumerate(shapes):
            place: dict[str, Any] = {
                'wxyz': _wxyz(shape.pose),
                'position': shape.pose.position,
                'color': tuple(round(255.0 * part) for part in shape.colour),
            }
            name = f'/robot/{shape.link}/{index}'
            match shape.kind:
                case 'box':
                    self._scene.add_box(name, dimensions=np.array(shape.size), **place)
                case 'cylinder':
                    radius, length = shape.size
                    self._scene.add_cylinder(name, radius=radius, height=length, **place)
                case 'sphere':
                    self._scene.add_icosphere(name, radius=shape.size[0], **place)

    @property
    def links(self) -> list[str]:
        """The links of the robot model that have shapes."""
        return list(self._links)

    def place_link(self, link: str, pose: Pose | None) -> None:
        """Move a link; one whose pose is not known is hidden."""
        handle, before = self._links[link]
        if pose is None:
            handle.visible = False
        elif before is None or not _same(before, pose):
            handle.visible = True
            handle.wxyz, handle.position = _wxyz(pose), pose.position
        self._links[link] = handle, pose

    def show_map(self, points: Points) -> None:
        """Draw the points of a map [m], shape (n, 3)."""
        middle = points.mean(axis=0)
        self._scene.add_point_cloud(
            '/map',
            points - middle,
            MAP_COLOUR,
            position=middle,
            point_size=POINT_SIZE,
            point_shading='flat',
            precision='float32',
        )

    def show_path(self, places: Array) -> None:
        """Draw the path of the robot: its places [m], shape (n, 3), n at least 2."""
        segments = np.stack([places[:-1], places[1:]], axis=1)
        self._scene.add_line_segments('/path', segments, PATH_COLOUR, thickness=0.05)

    def clear(self) -> None:
        """Remove all but the floor and the robot model."""
        self.show_cloud([])
        self._fan = None
        for name in ('/scan', '/map', '/path'):
            self._scene.remove_by_name(name)


def _floor() -> tuple[Array, NDArray[np.uint8]]:
    """Return the lines of the floor [m] and their colours, shape (n, 2, 3)."""
    at = np.arange(-FLOOR, FLOOR + 1)
    ends = np.array([-FLOOR, FLOOR])
    lines = np.zeros((2, len(at), 2, 3))
    lines[0, :, :, 0], lines[0, :, :, 1] = at[:, None], ends
    lines[1, :, :, 0], lines[1, :, :, 1] = ends, at[:, None]
    colours = np.where(at[:, None] % 5 == 0, FIFTH_COLOUR, FLOOR_COLOUR).astype(np.uint8)
    both_ends = np.broadcast_to(colours[:, None], lines.shape)
    return lines.reshape(-1, 2, 3), both_ends.reshape(-1, 2, 3)


def _wxyz(pose: Pose) -> Array:
    """Return the orientation as viser takes it."""
    return np.roll(pose.quaternion, 1)


def _same(one: Pose, other: Pose) -> bool:
    return np.array_equal(one.position, other.position) and np.array_equal(
        one.rotation, other.rotation
    )

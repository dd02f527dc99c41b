"""The tree of frames over time, without ROS: times are int nanoseconds, 0 means the latest."""

import math

from tf2_ros._links import Link, LinkHistory, StaticLink
from tf2_ros._rigid import compose, IDENTITY, inverse, normalized, Rigid
from tf2_ros.exceptions import (
    ExtrapolationException,
    InvalidArgumentException,
    TransformException,
)


class FrameTree:
    """All frames; each one except the roots has a parent, which may change over time."""

    def __init__(self, span_ns: int) -> None:
        self._span_ns = span_ns
        self._frames: dict[str, StaticLink | LinkHistory | None] = {}

    def clear(self) -> None:
        """Forget all links but the static ones; the frames stay known."""
        for frame in self._frames.values():
            if frame is not None:
                frame.clear()

    def set(self, frame: str, time_ns: int, link: Link, is_static: bool) -> bool:
        """Set a frame's link; return False if it is too old.

        Raises
        ------
        InvalidArgumentException
            If a name is missing, both are the same, or the pose is invalid.
        """
        frame, parent = frame.removeprefix('/'), link.parent.removeprefix('/')
        _check_link(frame, parent, link.pose)
        link = Link(parent, Rigid(link.pose.translation, normalized(link.pose.rotation)))
        self._frames.setdefault(parent, None)
        if is_static:
            self._frames[frame] = StaticLink(link)
            return True
        history = self._frames.get(frame)
        if not isinstance(history, LinkHistory):
            history = self._frames[frame] = LinkHistory(self._span_ns)
        return history.insert(time_ns, link)

    def lookup(self, target: str, source: str, time_ns: int) -> tuple[int, Rigid]:
        """Return the time found [ns] and the transform from source to target coordinates.

        Raises
        ------
        TransformException
            Names the frames and times that are at fault.
        """
        if target == source:
            frame = self._frames.get(target)
            return time_ns or (frame.latest_ns if frame else 0), IDENTITY
        for role, name in (('target_frame', target), ('source_frame', source)):
            self.check_name(name, role)
        time_ns = time_ns or self.latest_common_ns(target, source)
        try:
            source_to_top, target_to_top = self._climb_both(target, source, time_ns)
        except ExtrapolationException as error:
            route = f'when looking up transform from frame [{source}] to frame [{target}]'
            raise ExtrapolationException(f'{error}, {route}') from None
        pose = compose(inverse(target_to_top), source_to_top)
        return time_ns, Rigid(pose.translation, normalized(pose.rotation))

    def latest_common_ns(self, target: str, source: str) -> int:
        """Return the latest time at which the whole path is known, 0 if all of it is static."""
        if target == source:
            frame = self._frames.get(target)
            return frame.latest_ns if frame else 0
        up, down = self._latest_chain(source), self._latest_chain(target)
        top = next((name for name in down if name in up), None)
        if top is None:
            raise _unconnected(target, source)
        times = [chain[name] for chain in (up, down) for name in _below(chain, top)]
        return min((t for t in times if t), default=0)

    def check_name(self, name: str, role: str) -> None:
        """Check a frame's name; raises TransformException."""
        if name not in self._frames:
            argument = f'"{name}" passed to lookupTransform argument {role}'
            raise TransformException(f'{argument} does not exist. ')

    def _climb_both(self, target: str, source: str, time_ns: int) -> tuple[Rigid, Rigid]:
        """Return the poses of source and target in the nearest frame above both."""
        above_source, trouble = self._climb(source, time_ns)
        above_target, other_trouble = self._climb(target, time_ns)
        for name, pose in above_target.items():
            if name in above_source:
                return above_source[name], pose
        raise other_trouble or trouble or _unconnected(target, source)

    def _climb(
        self, name: str, time_ns: int
    ) -> tuple[dict[str, Rigid], ExtrapolationException | None]:
        """Return a frame's pose in itself and those above it, and the error that ended this."""
        poses, pose = {name: IDENTITY}, IDENTITY
        while (frame := self._frames[name]) is not None:
            try:
                link = frame.at(time_ns)
            except ExtrapolationException as error:
                return poses, error
            name, pose = link.parent, compose(link.pose, pose)
            _check_new(name, poses)
            poses[name] = pose
        return poses, None

    def _latest_chain(self, name: str) -> dict[str, int]:
        """Return a frame and those above it, with the latest time of each one's link."""
        chain: dict[str, int] = {}
        while True:
            _check_new(name, chain)
            frame = self._frames.get(name)
            chain[name] = frame.latest_ns if frame else 0
            link = frame.latest() if frame else None
            if link is None:
                return chain
            name = link.parent


def _below(chain: dict[str, int], top: str) -> list[str]:
    names = list(chain)
    return names[: names.index(top)]


def _check_new(name: str, chain: dict) -> None:
    if name in chain:
        loop = ' -> '.join([*chain, name])
        raise TransformException(f'The tf tree is invalid because it contains a loop: {loop}')


def _check_link(frame: str, parent: str, pose: Rigid) -> None:
    if not frame or not parent:
        raise InvalidArgumentException(
            f'a transform needs two frames: frame_id "{parent}", child_frame_id "{frame}"'
        )
    if frame == parent:
        raise InvalidArgumentException(f'frame_id and child_frame_id are both "{frame}"')
    if any(math.isnan(value) for part in pose for value in part):
        raise InvalidArgumentException(f'a nan value in the transform of "{frame}": {pose}')
    if not any(pose.rotation):
        raise InvalidArgumentException(f'the quaternion of "{frame}" is zero')


def _unconnected(target: str, source: str) -> TransformException:
    return TransformException(
        f"Could not find a connection between '{target}' and '{source}' because they are not "
        'part of the same tree.Tf has two or more unconnected trees.'
    )

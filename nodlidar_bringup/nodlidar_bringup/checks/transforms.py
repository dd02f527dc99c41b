"""Checks of the tree of frames."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from nodlidar_bringup.checks.finding import fault, Finding, good, unknown, warning
from nodlidar_bringup.checks.graph import LAUNCH, START_AGAIN

LARGEST_DIFFERENCE = 0.002
"""Between the lever arms of robot model and assembler [m]."""

_MODEL = f'{START_AGAIN}, whose robot_state_publisher publishes the robot model'


@dataclass(frozen=True, slots=True)
class Frames:
    """The transforms that were heard.

    Attributes
    ----------
    parents
        All parents that each frame was given.
    needed
        Frames of the sensor from the base frame to the lidar.
    scan_frames
        Frames in which scans are.
    lever
        Position of the lidar in the nodding frame, by the robot model [m]; None if unknown.
    assembler_lever
        The same, by the assembler's parameter laser_xyz [m]; None if unknown.
    joints_come
        Whether positions of the joint come, from which the transform of the nod is made.
    """

    parents: Mapping[str, frozenset[str]] = field(default_factory=dict)
    needed: tuple[str, ...] = ('nodlidar_base_link', 'nodlidar_tilt_link', 'laser')
    scan_frames: frozenset[str] = frozenset()
    lever: tuple[float, ...] | None = None
    assembler_lever: tuple[float, ...] | None = None
    joints_come: bool = True


def check_frames(frames: Frames) -> list[Finding]:
    """Return what is wrong with the frames."""
    findings = [*_two_parents(frames), *_missing(frames), *_scans(frames), *_levers(frames)]
    return findings or [good('transforms', f'{len(frames.parents)} frames, each with one parent')]


def _two_parents(frames: Frames) -> list[Finding]:
    return [
        fault(
            'two parents',
            f"the frame '{child}' has {len(parents)} parents: {', '.join(sorted(parents))}",
            f'end one of the publishers (ros2 topic info -v /tf), or {LAUNCH} frame_prefix:=left_',
        )
        for child, parents in sorted(frames.parents.items())
        if len(parents) > 1
    ]


def _missing(frames: Frames) -> list[Finding]:
    """Return the links of the chain from the base frame to the lidar that nobody publishes."""
    findings = []
    for parent, child in zip(frames.needed, frames.needed[1:], strict=False):
        if child not in frames.parents:
            text = f"nobody publishes the transform from '{parent}' to '{child}'"
            if child == frames.needed[1] and not frames.joints_come:
                text = f'{text}: it is made from positions of the joint, of which none come'
                findings.append(unknown('transform missing', text))
            else:
                findings.append(fault('transform missing', text, _MODEL))
        elif parent not in frames.parents[child]:
            others = ', '.join(sorted(frames.parents[child]))
            text = f"the parent of '{child}' is '{others}', not '{parent}'"
            findings.append(fault('wrong parent', text, _MODEL))
    return findings


def _scans(frames: Frames) -> list[Finding]:
    known = frames.parents.keys() | {name for p in frames.parents.values() for name in p}
    lost = sorted(frames.scan_frames - known)
    if not lost or not frames.parents:
        return []
    text = f"scans are in the frame '{lost[0]}', which no transform has"
    remedy = f"set the driver's frame_id to '{frames.needed[-1]}'"
    return [fault('unknown frame', text, remedy)]


def _levers(frames: Frames) -> list[Finding]:
    model, used = frames.lever, frames.assembler_lever
    if model is None or used is None:
        return []
    if max(abs(a - b) for a, b in zip(model, used, strict=True)) <= LARGEST_DIFFERENCE:
        return []
    text = f'the lidar is at {_metres(model)} in the robot model, at {_metres(used)} in the clouds'
    remedy = f'{LAUNCH} laser_xyz:="{" ".join(f"{value:g}" for value in model)}" sets both'
    return [warning('lever arms differ', text, remedy)]


def _metres(values: tuple[float, ...]) -> str:
    return f'({", ".join(f"{value:g}" for value in values)}) m'

"""Profiles: named defaults that trade accuracy against computing time (docs/tradeoffs.md)."""

from dataclasses import dataclass

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.parameters import parameter

PROFILES = {
    'fast': AssemblerConfig(command_rate=4.0, coverage_window=0.0),
    'balanced': AssemblerConfig(),
    'slam': AssemblerConfig(cloud_mode='sweep', ego_motion='deskew'),
}


@dataclass(frozen=True, slots=True)
class ProfileConfig:
    """Profile."""

    profile: str = parameter(
        'balanced',
        'Default values of the other parameters: how much accuracy is worth how much time. The '
        'launch argument of the same name also sets the feedback_rate of the servo',
        choices=tuple(PROFILES),
        live=True,
    )

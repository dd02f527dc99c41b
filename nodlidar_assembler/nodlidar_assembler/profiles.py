"""Profiles: named defaults that trade accuracy against computing time (docs/tradeoffs.md)."""

from dataclasses import dataclass, fields
from typing import Any

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


def governed() -> dict[str, dict[str, Any]]:
    """Return the parameters in which profiles differ, with their values by profile."""
    values = {
        field.name: {name: getattr(config, field.name) for name, config in PROFILES.items()}
        for field in fields(AssemblerConfig)
    }
    return {
        key: by_profile for key, by_profile in values.items() if len({*by_profile.values()}) > 1
    }

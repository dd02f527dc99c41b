"""The options that commands for bags have in common: topics, and the assembler's parameters."""

import argparse
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_topics import Topics, USUAL
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_common.parameter_file import file_values
from nodlidar_common.parameters import check


def configuration(params: Path | None, chosen: Mapping[str, Any]) -> AssemblerConfig:
    """Return the profile's parameters, overridden by those of a file, then by the chosen ones.

    Raises
    ------
    ParameterError
        If the file is not a parameter file, or a value is not allowed.
    OSError
        If the file cannot be read.
    """
    values: dict[str, Any] = {}
    if params is not None:
        for config_class in (ProfileConfig, AssemblerConfig):
            values |= file_values([params], 'assembler', config_class)
    values |= chosen
    profile = ProfileConfig(values.pop('profile', ProfileConfig().profile))
    check(profile)
    config = replace(PROFILES[profile.profile], **values)
    check(config)
    return config


def add_topics(parser: argparse.ArgumentParser, kinds: Iterable[str] = USUAL) -> None:
    """Add the options of the topics in a bag, of some types of messages."""
    for usual, option in (USUAL[kind] for kind in kinds):
        help_text = f'topic [default: {usual}, or the only one of its type]'
        parser.add_argument(option, metavar='TOPIC', default='', help=help_text)


def topics_of(arguments: argparse.Namespace) -> Topics:
    """Return the chosen topics, with a leading slash, as in bags."""
    chosen = arguments.scan, arguments.joint_states, getattr(arguments, 'tf', '')
    return Topics(*(topic and absolute(topic) for topic in chosen))


def absolute(topic: str) -> str:
    """Return a topic's name with a leading slash, as in bags."""
    return topic if topic.startswith('/') else f'/{topic}'

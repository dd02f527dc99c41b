"""A new profile while the node runs: a node with the new defaults takes over."""

from collections.abc import Callable
from dataclasses import fields

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_common.parameters import limits_of
from nodlidar_common.ros.node_parameters import declare
from rclpy.node import Node
from rclpy.parameter import Parameter


class ProfileChange:
    """Declares the profile of a node, and makes its successor when another one is chosen.

    Parameters which the user has set stay: at the start, or while the node ran.

    Parameters
    ----------
    node
        The assembler; its `config` are the present parameters.
    make
        Makes an assembler with some parameters.

    Attributes
    ----------
    defaults
        Of the other parameters.
    successor
        Makes the node that takes over; None as long as the profile is that of the start.
    """

    def __init__(self, node: Node, make: Callable[[list[Parameter]], Node]) -> None:
        self._node, self._make = node, make
        self._profile = declare(node, ProfileConfig, self._change)
        self.defaults = PROFILES[self._profile.profile]
        self.successor: Callable[[], Node] | None = None

    def _change(self, chosen: ProfileConfig) -> None:
        self.successor = lambda: self._make(
            [Parameter(name, value=value) for name, value in self._set(chosen.profile).items()]
        )

    def _set(self, profile: str) -> dict[str, object]:
        """Return what the user has set, with a profile."""
        given = {name: each.value for name, each in self._node._parameter_overrides.items()}
        config, before = self._node.config, self.defaults
        changed = {
            each.name: getattr(config, each.name)
            for each in fields(AssemblerConfig)
            if limits_of(each).live and getattr(config, each.name) != getattr(before, each.name)
        }
        return given | changed | {'profile': profile}

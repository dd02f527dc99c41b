"""A new profile while the node runs: a node with the new defaults takes over."""

from collections.abc import Callable
from dataclasses import fields, replace

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check, limits_of
from nodlidar_common.ros.node_parameters import declare
from rcl_interfaces.msg import SetParametersResult
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
        node.add_on_set_parameters_callback(self._checked)

    def _checked(self, parameters: list[Parameter]) -> SetParametersResult:
        """Refuse a profile that contradicts what is set, or that would end a scan of a region."""
        chosen = {each.name: each.value for each in parameters}
        profile = chosen.get('profile')
        if profile in PROFILES and profile != self._profile.profile:
            try:
                if self._node.scans_region:
                    limit = f'{self._profile.profile} until scan_region has ended'
                    raise ParameterError('profile', limit, profile)
                own = {each.name for each in fields(AssemblerConfig)}
                values = (self._set(profile) | chosen).items()
                check(replace(PROFILES[profile], **{k: v for k, v in values if k in own}))
            except ParameterError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _change(self, chosen: ProfileConfig) -> None:
        self.successor = lambda: self._make(
            [Parameter(name, value=value) for name, value in self._set(chosen.profile).items()]
        )

    def _set(self, profile: str) -> dict[str, object]:
        """Return what the user has set, with a profile."""
        given = {name: each.value for name, each in self._node._parameter_overrides.items()}
        live = {each.name for each in fields(AssemblerConfig) if limits_of(each).live}
        now = {name: getattr(self._node.config, name) for name in live}
        begun = {name: given.get(name, getattr(self.defaults, name)) for name in live}
        changed = {name: value for name, value in now.items() if value != begun[name]}
        clock = {'use_sim_time': self._node.get_parameter('use_sim_time').value}
        return given | changed | clock | {'profile': profile}

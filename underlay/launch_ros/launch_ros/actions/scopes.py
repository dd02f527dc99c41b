"""What holds for all nodes of a scope; a GroupAction ends it."""

from __future__ import annotations

from typing import Any

from launch import Action, LaunchContext, SomeSubstitutionsType
from launch.substitutions import SubstitutionFailure
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from rclpy.exceptions import InvalidNamespaceException
from rclpy.validate_namespace import validate_namespace

from ..namespaces import make_namespace_absolute, prefix_namespace
from ..parameters import evaluate_parameters


class PushROSNamespace(Action):
    """Put the nodes that follow into a namespace, in the one that holds already if relative."""

    def __init__(self, namespace: SomeSubstitutionsType, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.namespace = normalize_to_list_of_substitutions(namespace)

    def execute(self, context: LaunchContext) -> None:
        """Set it; SubstitutionFailure if it is no valid namespace."""
        previous = context.launch_configurations.get('ros_namespace')
        pushed = perform_substitutions(context, self.namespace)
        namespace = make_namespace_absolute(prefix_namespace(previous, pushed))
        try:
            validate_namespace(namespace)
        except InvalidNamespaceException as error:
            raise SubstitutionFailure(
                'The resulting namespace is invalid: '
                f"[previous_namespace='{previous}', pushed_namespace='{pushed}']"
            ) from error
        context.launch_configurations['ros_namespace'] = namespace


class SetParameter(Action):
    """Set a parameter of the nodes that follow."""

    def __init__(self, name: SomeSubstitutionsType, value: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._name = normalize_to_list_of_substitutions(name)
        self._value = value

    def execute(self, context: LaunchContext) -> None:
        """Set it."""
        previous = context.launch_configurations.get('global_params', [])
        pairs = evaluate_parameters(context, {tuple(self._name): self._value}).items()
        context.launch_configurations['global_params'] = [*previous, *pairs]

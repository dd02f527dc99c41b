"""Values and files of ROS parameters."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from launch import LaunchContext, SomeSubstitutionsType, Substitution
from launch.frontend import parse_substitution
from launch.substitutions import SubstitutionFailure
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch.utilities.type_utils import normalize_typed_substitution, perform_typed_substitution
from underlay_refusal import refuse
import yaml

from .temporary_file import temporary_file

__all__ = ['ParameterFile', 'ParameterValue']
__getattr__ = refuse(__name__, __all__)


class ParameterValue:
    """A parameter's value of a known type.

    Parameters
    ----------
    value
        The value, or substitutions whose text becomes it.
    value_type
        bool, int, float, str, a typing.List of one of them, or None for what YAML makes of it.

    """

    def __init__(self, value: Any, *, value_type: Any = None) -> None:
        self.value = normalize_typed_substitution(value, value_type)
        self.value_type = value_type

    def evaluate(self, context: LaunchContext) -> Any:
        """Return the value; ValueError if the text is none of the type."""
        return perform_typed_substitution(context, self.value, self.value_type)


class ParameterFile:
    """A file of parameters.

    Parameters
    ----------
    param_file
        Its path.
    allow_substs
        Whether the file has substitutions, as `$(var name)`, to be performed.

    """

    def __init__(
        self,
        param_file: os.PathLike | SomeSubstitutionsType,
        *,
        allow_substs: bool | SomeSubstitutionsType = False,
    ) -> None:
        if isinstance(param_file, os.PathLike):
            param_file = os.fspath(param_file)
        self._param_file: list[Substitution] = normalize_to_list_of_substitutions(param_file)
        self._allow_substs = normalize_typed_substitution(allow_substs, bool)

    def evaluate(self, context: LaunchContext) -> Path:
        """Return the path, with substitutions that of a file which lasts as long as this."""
        path = Path(perform_substitutions(context, self._param_file))
        if not perform_typed_substitution(context, self._allow_substs, bool):
            return path
        text = perform_substitutions(context, parse_substitution(path.read_text()))
        try:
            yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise SubstitutionFailure(
                f'The substituted parameter file is not a valid yaml file: {path}: {error}'
            ) from error
        return temporary_file(self, text)

"""Files that pass the parameters of dictionaries on to nodes."""

import atexit
from collections.abc import Mapping
from functools import cache
import shutil
from tempfile import mkdtemp, NamedTemporaryFile
from typing import Any

from launch import LaunchContext, Substitution
import yaml

from .parameter_descriptions import ParameterValue


def write_parameters(context: LaunchContext, node: str, parameters: Mapping[str, Any]) -> str:
    """Write a parameter file for a node, which is there until the interpreter ends.

    A value that no parameter can have is a yaml.YAMLError.
    """
    values = {name: _evaluate(context, value) for name, value in parameters.items()}
    text = yaml.safe_dump({node: {'ros__parameters': values}}, default_flow_style=False)
    with NamedTemporaryFile('w', dir=_directory(), suffix='.yaml', delete=False) as file:
        file.write(text)
    return file.name


def _evaluate(context: LaunchContext, value: Any) -> Any:
    if isinstance(value, Substitution):
        value = ParameterValue(value)
    return value.evaluate(context) if isinstance(value, ParameterValue) else value


@cache
def _directory() -> str:
    path = mkdtemp(prefix='launch_params_')
    atexit.register(shutil.rmtree, path)
    return path

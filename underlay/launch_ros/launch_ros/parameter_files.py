"""Files that pass the parameters of dictionaries to nodes."""

import atexit
from collections.abc import Mapping
from functools import cache
import shutil
from tempfile import mkdtemp, NamedTemporaryFile
from typing import Any

import yaml

from .parameter_descriptions import ParameterValue


def write_parameters(node: str, parameters: Mapping[str, Any]) -> str:
    """Write a parameter file for a node, to be removed when the interpreter ends.

    Raises yaml.YAMLError for a value that is not covered.
    """
    values = {
        name: value.value if isinstance(value, ParameterValue) else value
        for name, value in parameters.items()
    }
    text = yaml.safe_dump({node: {'ros__parameters': values}}, default_flow_style=False)
    with NamedTemporaryFile('w', dir=_directory(), suffix='.yaml', delete=False) as file:
        file.write(text)
    return file.name


@cache
def _directory() -> str:
    path = mkdtemp(prefix='launch_params_')
    atexit.register(shutil.rmtree, path)
    return path

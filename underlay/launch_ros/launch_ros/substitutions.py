"""Paths of packages and of their executables."""

from __future__ import annotations

import os
import shutil

from ament_index_python.packages import get_package_prefix
from launch import LaunchContext, SomeSubstitutionsType, Substitution
from launch.substitution import normalize, perform
from launch.substitutions import SubstitutionFailure
from underlay_refusal import refuse

__all__ = ['ExecutableInPackage']
__getattr__ = refuse(__name__, __all__)


class ExecutableInPackage(Substitution):
    """The path of an executable in the lib directory of a package."""

    def __init__(self, executable: SomeSubstitutionsType, package: SomeSubstitutionsType) -> None:
        self.executable = normalize(executable)
        self.package = normalize(package)

    def perform(self, context: LaunchContext) -> str:
        """Look in the directory; SubstitutionFailure if it has no such executable."""
        package = perform(context, self.package)
        executable = perform(context, self.executable)
        directory = os.path.join(get_package_prefix(package), 'lib', package)
        path = shutil.which(executable, path=directory)
        if path is None:
            raise SubstitutionFailure(
                f"executable '{executable}' not found on the libexec directory '{directory}' "
            )
        return path

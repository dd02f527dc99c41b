"""Paths of executables in packages."""

import os
import shutil

from ament_index_python.packages import get_package_prefix
from launch import LaunchContext
from underlay_refusal import Partial, refuse

__all__ = ['ExecutableInPackage']
__getattr__ = refuse(__name__, __all__)


class ExecutableInPackage(Partial):
    """The path of an executable in the lib directory of a package."""

    def __init__(self, executable: str, package: str) -> None:
        self.executable = executable
        self.package = package

    def perform(self, context: LaunchContext) -> str:
        """Return the path; raises PackageNotFoundError, or RuntimeError for the executable."""
        directory = os.path.join(get_package_prefix(self.package), 'lib', self.package)
        path = shutil.which(self.executable, path=directory)
        if path is None:
            raise RuntimeError(
                f"executable '{self.executable}' not found on the libexec directory '{directory}'"
            )
        return path

"""Paths of packages and of their executables."""

from __future__ import annotations

import os
import shutil

from ament_index_python.packages import get_package_prefix, get_package_share_directory
from launch import LaunchContext, SomeSubstitutionsType, Substitution
from launch.frontend import expose_substitution
from launch.substitutions import SubstitutionFailure
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from underlay_refusal import refuse

__all__ = ['ExecutableInPackage', 'FindPackagePrefix', 'FindPackageShare']
__getattr__ = refuse(__name__, __all__)


class _FindPackage(Substitution):
    def __init__(self, package: SomeSubstitutionsType) -> None:
        self.package = normalize_to_list_of_substitutions(package)

    def describe(self) -> str:
        """Name the package."""
        package = ' + '.join(sub.describe() for sub in self.package)
        return f'{type(self).__name__}(pkg={package})'


@expose_substitution('find-pkg-prefix')
class FindPackagePrefix(_FindPackage):
    """The prefix that a package is installed in; PackageNotFoundError if it isn't."""

    def perform(self, context: LaunchContext) -> str:
        """Look in the ament index."""
        return get_package_prefix(perform_substitutions(context, self.package))


@expose_substitution('find-pkg-share')
class FindPackageShare(_FindPackage):
    """The share directory of a package; PackageNotFoundError if it isn't installed."""

    def perform(self, context: LaunchContext) -> str:
        """Look in the ament index."""
        return get_package_share_directory(perform_substitutions(context, self.package))


@expose_substitution('exec-in-pkg')
class ExecutableInPackage(FindPackagePrefix):
    """The path of an executable in the lib directory of a package.

    Performing it raises SubstitutionFailure when there is no such executable.
    """

    def __init__(self, executable: SomeSubstitutionsType, package: SomeSubstitutionsType) -> None:
        super().__init__(package)
        self.executable = normalize_to_list_of_substitutions(executable)

    def perform(self, context: LaunchContext) -> str:
        """Look in the package's lib directory."""
        package = perform_substitutions(context, self.package)
        executable = perform_substitutions(context, self.executable)
        prefix = super().perform(context)
        directory = os.path.join(prefix, 'lib', package)
        if not os.path.exists(directory):
            raise SubstitutionFailure(
                f"package '{package}' found at '{prefix}', "
                f"but libexec directory '{directory}' does not exist"
            )
        path = shutil.which(executable, path=directory)
        if path is None:
            raise SubstitutionFailure(
                f"executable '{executable}' not found on the libexec directory '{directory}' "
            )
        return path

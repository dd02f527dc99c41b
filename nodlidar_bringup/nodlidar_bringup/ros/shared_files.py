"""The files that packages install for others."""

import os

from ament_index_python.packages import get_package_share_directory


def share(package: str, path: str) -> str:
    """Return a file in a package's share folder."""
    return os.path.join(get_package_share_directory(package), path)

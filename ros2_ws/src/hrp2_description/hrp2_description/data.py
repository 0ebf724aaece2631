"""The paths of this package's data files, and of other packages' folders."""

from __future__ import annotations

import sys
from pathlib import Path


def data_path(name: str) -> Path:
    """Return the path of a data file, such as ``config/robot.yaml`` or ``urdf/hrp2.urdf``."""
    return Path(__file__).parent / name


def share_folders(package: str) -> list[Path]:
    """Return the folders in which ROS or pip may have installed a package's files.

    The folders of pip are those of packages that cmeel has built, as Pinocchio's are.

    Args:
        package: Name of the package.
    """
    by_pip = [Path(entry) / "cmeel.prefix" / "share" / package for entry in sys.path]
    try:
        from ament_index_python.packages import get_package_share_directory

        return [Path(get_package_share_directory(package)), *by_pip]
    except (ImportError, LookupError):  # not ROS, or no such package
        return by_pip

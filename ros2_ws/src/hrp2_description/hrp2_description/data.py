"""The paths of this package's data files, and of other packages' folders."""

from __future__ import annotations

import re
import sys
from pathlib import Path

_IN_PACKAGE = re.compile(r"(?:package:///?|/.*/share/)([A-Za-z][\w-]*)/([^/\0][^\0]*)")


def data_path(name: str) -> Path:
    """Return the path of a data file, such as ``config/robot.yaml`` or ``urdf/hrp2.urdf``."""
    return Path(__file__).parent / name


def package_file(name: str) -> Path | None:
    """Return the path of a file of an installed package; None if there is no such file.

    Only files within a package's own folder are found: a URDF may come from the network.

    Args:
        name: ``package://PACKAGE/PATH``, or ``/.../share/PACKAGE/PATH`` on any machine.
    """
    named = _IN_PACKAGE.fullmatch(name)
    if named is None or ".." in Path(named[2]).parts:
        return None
    paths = (folder / named[2] for folder in share_folders(named[1]))
    return next((path for path in paths if path.is_file()), None)


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

"""The paths of this package's data files."""

from __future__ import annotations

import sys
from pathlib import Path

from hrp2_description.errors import DataFileNotFoundError

PACKAGE = "hrp2_description"


def data_path(name: str) -> Path:
    """Return the path of a data file.

    A module that runs from the source tree uses the file there, so that an older installed copy
    never hides an edited file; otherwise the ament index has the path.

    Args:
        name: Path within the package, for example ``config/robot.yaml`` or ``urdf/hrp2.urdf``.

    Raises:
        DataFileNotFoundError: The file is in neither place.
    """
    tried: list[str] = []
    source = Path(__file__).resolve().parents[1]
    if (source / "package.xml").is_file():
        path = source / name
        if path.is_file():
            return path
        tried.append(str(path))
    share = _ament_share(PACKAGE)
    if share is None:
        tried.append(f"ament index (no {PACKAGE})")
    elif (share / name).is_file():
        return share / name
    else:
        tried.append(str(share / name))
    raise DataFileNotFoundError(f"no data file {name}", value=tried, limit=f"a file {name}")


def share_folders(package: str) -> list[Path]:
    """Return the folders in which ROS or pip may have installed a package's files.

    The folders of pip are those of packages that cmeel has built, as Pinocchio's are.

    Args:
        package: Name of the package.
    """
    share = _ament_share(package)
    by_pip = [Path(entry) / "cmeel.prefix" / "share" / package for entry in sys.path]
    return by_pip if share is None else [share, *by_pip]


def _ament_share(package: str) -> Path | None:
    try:
        from ament_index_python.packages import (
            PackageNotFoundError,
            get_package_share_directory,
        )
    except ImportError:
        return None
    try:
        return Path(get_package_share_directory(package))
    except PackageNotFoundError:
        return None

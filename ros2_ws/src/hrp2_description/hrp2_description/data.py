"""Where this package's data files are."""

from __future__ import annotations

import sys
from pathlib import Path

from hrp2_description.errors import DataFileNotFoundError

PACKAGE = "hrp2_description"


def data_path(name: str) -> Path:
    """Return the path of a data file, e.g. ``config/robot.yaml`` or ``urdf/hrp2.urdf``.

    The source tree comes first when the module runs from it, so that an edited file is never
    hidden by an older installed copy; otherwise the ament index tells.

    Raises:
        DataFileNotFoundError: If the file is in neither place.
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
    """Return where ROS, and pip for a package built by cmeel as Pinocchio is, put its files."""
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

"""Where this package's data files are."""

from __future__ import annotations

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
    share = share_folder(PACKAGE)
    if share is None:
        tried.append(f"ament index (no {PACKAGE})")
    elif (share / name).is_file():
        return share / name
    else:
        tried.append(str(share / name))
    raise DataFileNotFoundError(f"no data file {name}", value=tried, limit=f"a file {name}")


def share_folder(package: str) -> Path | None:
    """Return the folder of a package's files by the ament index; None without the one or both."""
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

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
    try:
        from ament_index_python.packages import (
            PackageNotFoundError,
            get_package_share_directory,
        )
    except ImportError:
        tried.append("ament_index_python (not importable)")
    else:
        try:
            path = Path(get_package_share_directory(PACKAGE)) / name
        except PackageNotFoundError:
            tried.append(f"ament index (no {PACKAGE})")
        else:
            if path.is_file():
                return path
            tried.append(str(path))
    raise DataFileNotFoundError(f"no data file {name}", value=tried, limit=f"a file {name}")

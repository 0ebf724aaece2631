"""Finds the data files of this package."""

import contextlib
from pathlib import Path

from door_model.errors import ConfigError

PACKAGE = "door_model"


def data_path(name: str) -> Path:
    """Return the path of a data file or folder of this package, such as "doors".

    The installed share folder is tried first, then the source tree.

    Raises:
        ConfigError: The file is in neither of them.
    """
    candidates = [Path(__file__).resolve().parents[1] / name]
    try:
        from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
    except ImportError:
        pass
    else:
        with contextlib.suppress(PackageNotFoundError):
            candidates.insert(0, Path(get_package_share_directory(PACKAGE)) / name)
    for candidate in candidates:
        if candidate.exists():
            return candidate
    tried = ", ".join(str(candidate) for candidate in candidates)
    raise ConfigError(
        PACKAGE, f"the data {name!r} were not found; tried {tried}", value=name, limit=tried)

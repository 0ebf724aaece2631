"""Where this package's data files are."""

import contextlib
from pathlib import Path

from door_model.errors import ConfigError

PACKAGE = "door_model"


def data_path(name: str) -> Path:
    """Path of a data file or folder of this package, such as "doors".

    The installed share folder is asked for first, then the source tree.

    Raises:
        ConfigError: It is in neither.
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
    raise ConfigError(PACKAGE, f"no data {name!r}; looked for {tried}", value=name, limit=tried)

"""The definitions of Jazzy's messages, which rosbags contains as Python classes.

Loading these classes would take a tenth of a second at the start of every node and command. The
definitions are therefore kept in a file, until another version of rosbags is installed.
"""

from __future__ import annotations

import os
import pickle
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import rosbags


def _kept_in() -> Path:
    """The file for the rosbags that is installed."""
    source = (Path(rosbags.__path__[0]) / "typesys/stores/ros2_jazzy.py").stat()
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return folder / "ros2_embedded" / f"jazzy_{source.st_mtime_ns}_{source.st_size}.pickle"


def _keep(definitions: dict[str, Any], path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        pickle.dump(definitions, file)
    Path(file.name).replace(path)  # atomic, since other processes may read the file


@cache
def definitions() -> dict[str, Any]:
    """Constants and fields of each message, by full name, as rosbags' `fielddefs` has them."""
    with suppress(OSError, RuntimeError, pickle.UnpicklingError, EOFError, AttributeError):
        with _kept_in().open("rb") as file:
            kept: dict[str, Any] = pickle.load(file)
        return kept
    from rosbags.typesys import Stores, get_typestore  # slow to import

    found = dict(get_typestore(Stores.ROS2_JAZZY).fielddefs)
    with suppress(OSError, RuntimeError):  # there is no home folder, or it is read-only
        _keep(found, _kept_in())
    return found

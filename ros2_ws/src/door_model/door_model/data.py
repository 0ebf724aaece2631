"""The paths of this package's data files."""

from pathlib import Path


def data_path(name: str) -> Path:
    """Return the path of a data file or folder, such as "doors"."""
    return Path(__file__).parent / name

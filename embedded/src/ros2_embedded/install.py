"""Symlink install of a workspace: `python -m ros2_embedded.install ros2_ws/src`.

Does what `colcon build --symlink-install` would do, as far as it is needed: Python packages are
installed with pip as editable, interface packages get an importable module, and each package's
folder is linked into the ament index of this interpreter's prefix. Packages that have not changed
are skipped.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import sysconfig
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

_FINGERPRINTED = ("setup.py", "setup.cfg", "package.xml")
_IGNORE_MARKERS = ("COLCON_IGNORE", "AMENT_IGNORE")

_STUB = '''"""Interface package {name}: made by ros2_embedded.install."""

from ros2_embedded.message_modules import provide

provide(__name__)
'''


@dataclass(frozen=True)
class Package:
    """A ROS package's source folder."""

    name: str
    build_type: str
    folder: Path

    @property
    def is_python(self) -> bool:
        """Whether pip installs it."""
        return self.build_type == "ament_python"

    @property
    def has_interfaces(self) -> bool:
        """Whether it defines messages, services or actions."""
        return any((self.folder / kind).is_dir() for kind in ("msg", "srv", "action"))

    def fingerprint(self) -> str:
        """Changes when the package must be installed anew."""
        digest = hashlib.sha256(str(self.folder).encode())
        for name in _FINGERPRINTED:
            path = self.folder / name
            digest.update(path.read_bytes() if path.is_file() else b"-")
        return digest.hexdigest()


def find_packages(workspace: Path) -> list[Package]:
    """Every package below a folder.

    Raises:
        ValueError: a package.xml that cannot be read.
    """
    found = []
    for manifest in sorted(workspace.rglob("package.xml")):
        folder = manifest.parent
        if any((folder / marker).exists() for marker in _IGNORE_MARKERS):
            continue
        try:
            root = ElementTree.parse(manifest).getroot()
        except ElementTree.ParseError as error:
            raise ValueError(f"{manifest}: {error}") from error
        name = (root.findtext("name") or "").strip()
        build_type = (root.findtext("export/build_type") or "ament_cmake").strip()
        if not name:
            raise ValueError(f"{manifest}: no name")
        found.append(Package(name, build_type, folder.resolve()))
    return found


def _share() -> Path:
    return Path(sys.prefix) / "share"


def _is_current(package: Package) -> bool:
    stamp = _share() / "ros2_embedded" / package.name
    if not stamp.is_file() or stamp.read_text() != package.fingerprint():
        return False
    if package.is_python:
        try:
            distribution(package.name)
        except PackageNotFoundError:
            return False
    return (_share() / package.name).resolve() == package.folder


def _register(package: Package) -> None:
    """Links the folder and writes the marker into the ament index."""
    link = _share() / package.name
    if link.is_symlink():
        link.unlink()
    elif link.exists():
        raise ValueError(f"{link} is in the way: it is no link of this command's")
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(package.folder, target_is_directory=True)
    marker = _share() / "ament_index" / "resource_index" / "packages" / package.name
    marker.parent.mkdir(parents=True, exist_ok=True)
    marker.touch()
    if package.has_interfaces and not package.is_python:
        stub = Path(sysconfig.get_path("purelib")) / package.name / "__init__.py"
        stub.parent.mkdir(exist_ok=True)
        stub.write_text(_STUB.format(name=package.name), encoding="utf-8")
    stamp = _share() / "ros2_embedded" / package.name
    stamp.parent.mkdir(exist_ok=True)
    stamp.write_text(package.fingerprint())


def install(workspace: Path) -> list[str]:
    """Installs what has changed; returns the names of the packages that were installed.

    Raises:
        ValueError: there are no packages, or one cannot be read.
        subprocess.CalledProcessError: pip failed.
    """
    packages = find_packages(workspace)
    if not packages:
        raise ValueError(f"{workspace}: no package.xml in it")
    changed = [package for package in packages if not _is_current(package)]
    editable = [part for p in changed if p.is_python for part in ("-e", str(p.folder))]
    if editable:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
               "--no-deps", "--no-build-isolation", "--use-pep517"]  # fmt: skip
        quiet = {
            **os.environ,
            "PYTHONWARNINGS": "ignore",
        }  # setuptools warns of every editable install
        subprocess.run([*pip, *editable], check=True, env=quiet)
    for package in changed:
        _register(package)
    return [package.name for package in changed]


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="ros2_embedded.install", description=__doc__)
    parser.add_argument("workspace", type=Path, help="folder with packages, such as ros2_ws/src")
    workspace = parser.parse_args().workspace
    try:
        changed = install(workspace)
    except (ValueError, subprocess.CalledProcessError) as error:
        print(f"ros2_embedded.install: {error}", file=sys.stderr)
        return 1
    print(f"installed: {', '.join(changed)}" if changed else "nothing has changed")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Symlink install of a workspace: `python -m ros2_embedded.install ros2_ws/src`.

Does what `colcon build --symlink-install` does with packages of Python and of interfaces. Python
packages are installed with pip as editable, and the `data_files` of their setup.py are linked below
the prefix of this interpreter. Of ament_cmake packages, the interfaces and the Python packages
become importable and the source folder becomes the share folder; their CMakeLists.txt is not
run. Packages that have not changed are skipped.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import sysconfig
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

_FINGERPRINTED = ("setup.py", "setup.cfg", "package.xml", "CMakeLists.txt")
_IGNORE_MARKERS = ("COLCON_IGNORE", "AMENT_IGNORE")

_STUB = '''"""Interface package {name}: made by ros2_embedded.install."""

from ros2_embedded.message_modules import provide

provide(__name__)
'''

# Prints the data_files of the packages in the given folders, in a line of JSON each.
_PRINT_DATA_FILES = """
import json, os, sys
import setuptools
from distutils.core import run_setup
out, sys.stdout = sys.stdout, sys.stderr
for folder in sys.argv[1:]:
    os.chdir(folder)
    sys.path[0] = folder
    print(json.dumps(run_setup("setup.py", stop_after="config").data_files or []), file=out)
"""
_INSTALLS_PYTHON = re.compile(
    r"^\s*ament_python_install_package\s*\(\s*(\S+?)(?:\s+PACKAGE_DIR\s+([^\s)]+))?\s*[\s)]", re.M
)
_BUILDS_PROGRAMS = re.compile(r"^\s*add_(executable|library)\s*\(|\bPROGRAMS\b", re.M)


@dataclass(frozen=True)
class Package:
    """The source folder of a ROS package."""

    name: str
    build_type: str
    folder: Path

    @property
    def is_python(self) -> bool:
        """Whether the package is installed with pip."""
        return self.build_type == "ament_python"

    @property
    def has_interfaces(self) -> bool:
        """Whether the package defines messages, services or actions."""
        return any((self.folder / kind).is_dir() for kind in ("msg", "srv", "action"))

    def cmake_lists(self) -> str:
        """The text of the package's CMakeLists.txt; empty if the file does not exist."""
        path = self.folder / "CMakeLists.txt"
        return path.read_text(encoding="utf-8") if path.is_file() else ""

    def cmake_links(self) -> dict[str, str]:
        """Links of an ament_cmake package: its share folder, and the Python packages in it."""
        links = {f"share/{self.name}": str(self.folder)}
        for match in _INSTALLS_PYTHON.finditer(self.cmake_lists()):
            name = match[1].replace("${PROJECT_NAME}", self.name)
            folder = (match[2] or name).replace("${PROJECT_NAME}", self.name)
            if name == self.name and self.has_interfaces:
                raise ValueError(f"{self.folder}: its interfaces and its Python package {name} "
                                 "have the same name")  # fmt: skip
            links[str(_site() / name)] = str(self.folder / folder)
        return links


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


def _site() -> Path:
    return Path(sysconfig.get_path("purelib"))


def _plan(packages: list[Package]) -> dict[Package, dict[str, str]]:
    """The links of each package: path below the prefix, and the source that it points to.

    Raises:
        ValueError: a setup.py fails, or lists a file that does not exist.
    """
    python = [package for package in packages if package.is_python]
    plan = {package: package.cmake_links() for package in packages if not package.is_python}
    command = [sys.executable, "-c", _PRINT_DATA_FILES, *(str(p.folder) for p in python)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        failed = python[len(done.stdout.splitlines())].folder
        raise ValueError(f"{failed}/setup.py fails:\n{done.stderr}")
    for package, line in zip(python, done.stdout.splitlines(), strict=True):
        links = plan[package] = {f"share/{package.name}/package.xml": "package.xml"}
        for target, files in json.loads(line):
            links.update({f"{target}/{Path(file).name}": file for file in files})
        for link, file in links.items():
            links[link] = str(package.folder / file)
            if not Path(links[link]).is_file():
                raise ValueError(f"{package.folder}/setup.py: {file} in data_files is no file")
    return plan


def _stamp(package: Package, links: dict[str, str]) -> str:
    """The content of the package's stamp, which changes when it must be installed again."""
    digest = hashlib.sha256()
    for name in _FINGERPRINTED:
        path = package.folder / name
        digest.update(path.read_bytes() if path.is_file() else b"-")
    return json.dumps([digest.hexdigest(), links])


def _stamp_file(package: Package) -> Path:
    return _share() / "ros2_embedded" / package.name


def _is_current(package: Package, links: dict[str, str]) -> bool:
    stamp = _stamp_file(package)
    if not stamp.is_file() or stamp.read_text() != _stamp(package, links):
        return False
    if package.is_python:
        try:
            distribution(package.name)
        except PackageNotFoundError:
            return False
    paths = [Path(sys.prefix) / link for link in links]
    return all(path.is_symlink() for path in paths) and [
        os.readlink(path) for path in paths
    ] == list(links.values())


def _remove_old_links(package: Package) -> None:
    """Removes the links that an earlier install of the package has made.

    Raises:
        ValueError: there is a share folder that this command has not made.
    """
    stamp, share = _stamp_file(package), _share() / package.name
    old = json.loads(text)[1] if stamp.is_file() and (text := stamp.read_text())[:1] == "[" else {}
    for path in [share, *(Path(sys.prefix) / link for link in old)]:
        if path.is_symlink():
            path.unlink()
    if share.exists() and not old:
        raise ValueError(f"{share} is in the way: it is no link of this command's")


def _register(package: Package, links: dict[str, str]) -> None:
    """Makes the links, and writes the marker into the ament index."""
    _remove_old_links(package)
    marker = _share() / "ament_index" / "resource_index" / "packages" / package.name
    marker.unlink(missing_ok=True)
    for link, file in links.items():
        path = Path(sys.prefix) / link
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_symlink():
            path.unlink()
        elif path.exists():
            raise ValueError(f"{path} is in the way: it is no link of this command's")
        path.symlink_to(file)
    marker.parent.mkdir(parents=True, exist_ok=True)
    if not marker.exists():
        marker.touch()
    if package.has_interfaces and not package.is_python:
        stub = _site() / package.name / "__init__.py"
        stub.parent.mkdir(exist_ok=True)
        stub.write_text(_STUB.format(name=package.name), encoding="utf-8")
    stamp = _stamp_file(package)
    stamp.parent.mkdir(exist_ok=True)
    stamp.write_text(_stamp(package, links))


def install(workspace: Path) -> list[str]:
    """Installs what has changed; returns the names of the packages that were installed.

    Raises:
        ValueError: there are no packages, or one cannot be read.
        subprocess.CalledProcessError: pip failed.
    """
    packages = find_packages(workspace)
    if not packages:
        raise ValueError(f"{workspace}: no package.xml in it")
    plan = _plan(packages)
    changed = [package for package in packages if not _is_current(package, plan[package])]
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
        _register(package, plan[package])
        if not package.is_python and _BUILDS_PROGRAMS.search(package.cmake_lists()):
            text = "programs and libraries in CMakeLists.txt are not supported here and were not"
            print(f"{package.name}: {text} installed", file=sys.stderr)
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

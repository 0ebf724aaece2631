"""What the packages say they need is what they import; the container brings no second opinion."""

import ast
import math
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

SOURCE = Path(__file__).resolve().parents[1] / "ros2_ws" / "src"
PACKAGES = sorted(path.parent for path in SOURCE.glob("*/package.xml"))
KEYS = {  # rosdep's key of a module that is called otherwise
    "PIL": "python3-pil", "hypothesis": "python3-hypothesis", "matplotlib": "python3-matplotlib",
    "mujoco": "python3-mujoco-pip", "numpy": "python3-numpy",
    "pybullet": "python3-pybullet-pip", "pytest": "python3-pytest",
    "rosbags": "python3-rosbags-pip", "scipy": "python3-scipy",
    "tqdm": "python3-tqdm", "yaml": "python3-yaml"}
SHIPPED = {"pybullet_utils"}  # comes with pybullet
# rosdep has no keys of these, or of an older version (pydantic). The README's command brings them.
BY_PIP = {"dask", "distributed", "mcap", "msgspec", "playwright", "pyarrow", "pydantic", "trimesh",
          "viser", "websockets", "yourdfpy", "zstandard"}
# What tests share; pytest's configuration has this folder on the path.
HELPERS = {path.stem for path in Path(__file__).parent.glob("*.py")}


def imported(folder: Path) -> set[str]:
    """rosdep keys of what the modules of a folder import, whole functions included."""
    names: set[str] = set()
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module.split(".")[0])
    given = sys.stdlib_module_names | SHIPPED | BY_PIP
    return {KEYS.get(name, name) for name in names - given}


def declared(package: Path, *kinds: str) -> set[str]:
    """The dependencies of some kinds in package.xml."""
    root = ElementTree.parse(package / "package.xml").getroot()
    return {element.text or "" for kind in ("depend", *kinds) for element in root.iter(kind)}


def launched(package: Path) -> set[str]:
    """Packages whose nodes or files its launch files name or its modules launch, and `launch`."""
    files = [yaml.safe_load(path.read_text(encoding="utf-8"))
             for path in package.glob("launch/*.yaml")]
    named = re.findall(r"(?:\bpkg: |find-pkg-share )(\w+)", yaml.dump(files, width=math.inf))
    modules = (package / package.name).rglob("*.py")
    code = "".join(path.read_text(encoding="utf-8") for path in modules)
    started = {*named, *re.findall(r'"launch", "(\w+)"', code)} - {package.name}
    return started | ({"launch", "launch_ros", "ros2launch"} if files else set())


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_every_import_is_a_declared_dependency(package: Path) -> None:
    """So that rosdep brings all that a package needs, on a machine that has nothing yet."""
    needed = imported(package / package.name) - {package.name}
    assert needed <= declared(package, "exec_depend")
    in_tests = imported(package / "test") - {package.name, "setuptools"} - HELPERS
    assert in_tests <= declared(package, "exec_depend", "test_depend")


PYTHON_PACKAGES = [package for package in PACKAGES if (package / "setup.py").exists()]


@pytest.mark.parametrize("package", PYTHON_PACKAGES, ids=lambda package: package.name)
def test_nothing_is_declared_that_no_module_imports(package: Path) -> None:
    """Left over dependencies cost every user an installation."""
    used = imported(package / package.name) | launched(package)
    assert declared(package, "exec_depend") <= used


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_every_package_that_is_launched_is_a_declared_dependency(package: Path) -> None:
    """But for those that depend on this package already: colcon refuses circles."""
    above = {each.name for each in PACKAGES if package.name in declared(each, "exec_depend")}
    assert launched(package) - above <= declared(package, "exec_depend")


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_the_container_pins_the_engines_of_the_requirements(engine: str) -> None:
    """One physics on both ways of installing."""
    top = SOURCE.parents[1]
    requirements = (top / "requirements.txt").read_text(encoding="utf-8").splitlines()
    pinned = next(line.split()[0] for line in requirements if line.startswith(f"{engine}=="))
    dockerfile = (top / "docker" / "Dockerfile").read_text(encoding="utf-8")
    (engines,) = re.findall('ARG ENGINES="(.*)"', dockerfile)
    assert pinned in engines.split()
    assert "pip install ${ENGINES} " in dockerfile


def test_what_a_machine_lacks_is_named_before_anything_is_installed() -> None:
    """On a machine whose path has no compiler and no cmake."""
    done = subprocess.run([sys.executable, SOURCE.parent / "wheels.py", "check"], env={"PATH": ""},
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "apt install g++ cmake" in done.stderr

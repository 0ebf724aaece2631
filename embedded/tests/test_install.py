"""The symlink install."""

import subprocess
from pathlib import Path

import pytest
from ros2_embedded import install

MANIFEST = (
    "<package format='3'><name>{}</name><export><build_type>{}</build_type></export></package>"
)


def package(folder: Path, name: str, build_type: str) -> Path:
    """Writes a package without content."""
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(MANIFEST.format(name, build_type))
    return folder


SETUP = """
from glob import glob
from setuptools import setup
setup(name="robot", version="1", packages=["robot"], data_files=[
    ("share/ament_index/resource_index/packages", ["resource/robot"]),
    ("share/robot", ["package.xml"]), ("share/robot/config", sorted(glob("settings/*.yaml")))])
"""


def python_package(folder: Path) -> Path:
    """Writes a package of Python whose setup.py installs the files of `settings`."""
    source = package(folder / "robot", "robot", "ament_python")
    for name in ("settings", "resource", "robot"):
        (source / name).mkdir()
    (source / "setup.py").write_text(SETUP)
    (source / "resource" / "robot").touch()
    (source / "robot" / "__init__.py").touch()
    (source / "settings" / "a.yaml").write_text("old")
    return source


@pytest.fixture
def no_pip(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves pip out: the tests look at links only."""
    run = subprocess.run

    def run_other(command: list[str], **options: object) -> object:
        return None if "pip" in command else run(command, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(install.subprocess, "run", run_other)
    monkeypatch.setattr(install, "distribution", lambda _: None)


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A prefix of its own instead of the interpreter's."""
    folder = tmp_path / "prefix"
    monkeypatch.setattr(install.sys, "prefix", str(folder))
    monkeypatch.setattr(install.sysconfig, "get_path", lambda _: str(folder / "site"))
    (folder / "site").mkdir(parents=True)
    return folder


def test_interface_packages_are_linked_once(tmp_path: Path, prefix: Path) -> None:
    """Link, marker and module are made; a second time nothing is done until something changes."""
    source = package(tmp_path / "src" / "my_msgs", "my_msgs", "ament_cmake")
    (source / "msg").mkdir()
    assert install.install(tmp_path / "src") == ["my_msgs"]
    assert (prefix / "share" / "my_msgs").resolve() == source
    assert (prefix / "share/ament_index/resource_index/packages/my_msgs").is_file()
    assert (prefix / "site" / "my_msgs" / "__init__.py").is_file()
    assert install.install(tmp_path / "src") == []
    (source / "setup.cfg").write_text("# new")
    assert install.install(tmp_path / "src") == ["my_msgs"]


@pytest.mark.usefixtures("no_pip")
def test_data_files_are_linked(tmp_path: Path, prefix: Path) -> None:
    """The share folder has what setup.py lists and no more; edits and new files take effect."""
    source = python_package(tmp_path / "src")
    share = prefix / "share" / "robot"
    assert install.install(tmp_path / "src") == ["robot"]
    assert (prefix / "share/ament_index/resource_index/packages/robot").is_file()
    assert {path.name for path in share.iterdir()} == {"package.xml", "config"}
    assert (share / "config" / "a.yaml").resolve() == source / "settings" / "a.yaml"
    (source / "settings" / "a.yaml").write_text("new")
    assert (share / "config" / "a.yaml").read_text() == "new"
    assert install.install(tmp_path / "src") == []
    (source / "settings" / "a.yaml").rename(source / "settings" / "b.yaml")
    assert install.install(tmp_path / "src") == ["robot"]
    assert [path.name for path in (share / "config").iterdir()] == ["b.yaml"]
    assert (source / "settings" / "b.yaml").read_text() == "new"


@pytest.mark.usefixtures("no_pip")
def test_a_share_folder_that_was_linked_as_a_whole_is_replaced(
    tmp_path: Path, prefix: Path
) -> None:
    """An install by an earlier version is replaced, and its source folder is left as it is."""
    source = python_package(tmp_path / "src")
    before = sorted(source.rglob("*"))
    for folder in ("ros2_embedded", "ament_index/resource_index/packages"):
        (prefix / "share" / folder).mkdir(parents=True)
        (prefix / "share" / folder / "robot").touch()
    (prefix / "share" / "robot").symlink_to(source)
    assert install.install(tmp_path / "src") == ["robot"]
    assert (prefix / "share" / "robot" / "config" / "a.yaml").is_symlink()
    assert sorted(source.rglob("*")) == before


@pytest.mark.usefixtures("no_pip")
def test_a_setup_that_fails_is_an_error(tmp_path: Path, prefix: Path) -> None:
    """The error names the setup.py, and the data file that does not exist."""
    source = python_package(tmp_path / "src")
    (source / "resource" / "robot").unlink()
    with pytest.raises(ValueError, match=r"robot/setup\.py: resource/robot in data_files is no"):
        install.install(tmp_path / "src")
    (source / "setup.py").write_text("1 / 0")
    with pytest.raises(ValueError, match=r"(?s)robot/setup\.py fails:.*ZeroDivisionError"):
        install.install(tmp_path / "src")


def test_python_in_an_ament_cmake_package_is_importable(
    tmp_path: Path, prefix: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """CMakeLists.txt says which folders; what would need a compiler is said to be left out."""
    source = package(tmp_path / "src" / "mixed", "mixed", "ament_cmake")
    (source / "mixed").mkdir()
    (source / "src" / "more").mkdir(parents=True)
    cmake = "project(mixed)\nament_python_install_package(${PROJECT_NAME})\n"
    (source / "CMakeLists.txt").write_text(
        f"{cmake}ament_python_install_package(more\n  PACKAGE_DIR src/more)\n"
    )
    assert install.install(tmp_path / "src") == ["mixed"]
    assert (prefix / "site" / "mixed").resolve() == source / "mixed"
    assert (prefix / "site" / "more").resolve() == source / "src" / "more"
    assert capsys.readouterr().err == ""
    (source / "CMakeLists.txt").write_text(f"{cmake}add_executable(node src/node.cpp)\n")
    assert install.install(tmp_path / "src") == ["mixed"]
    assert not (prefix / "site" / "more").exists()
    assert capsys.readouterr().err == (
        "mixed: programs and libraries in CMakeLists.txt are not supported here and were not "
        "installed\n"
    )
    (source / "msg").mkdir()
    with pytest.raises(ValueError, match="its Python package mixed have the same name"):
        install.install(tmp_path / "src")


def test_a_folder_in_the_way_is_not_removed(tmp_path: Path, prefix: Path) -> None:
    """What this command has not made, it does not replace."""
    package(tmp_path / "src" / "my_msgs", "my_msgs", "ament_cmake")
    (prefix / "share" / "my_msgs").mkdir(parents=True)
    with pytest.raises(ValueError, match="in the way"):
        install.install(tmp_path / "src")


def test_broken_workspaces_are_errors(tmp_path: Path, prefix: Path) -> None:
    """No package, or one that cannot be read, is an error."""
    with pytest.raises(ValueError, match=r"no package\.xml"):
        install.install(tmp_path)
    (tmp_path / "package.xml").write_text("<package>")
    with pytest.raises(ValueError, match=r"package\.xml"):
        install.install(tmp_path)

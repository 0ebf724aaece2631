"""The symlink install."""

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

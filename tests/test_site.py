"""The site of the documentation builds without a warning, and explains every public name."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

griffe = pytest.importorskip("griffe", reason="`make docs` installs what the site needs")
ROOT = Path(__file__).resolve().parents[1]
PACKAGES = sorted(path.parent.name for path in (ROOT / "ros2_ws/src").glob("*/*/__init__.py")
                  if path.parent.name == path.parent.parent.name)


def public(thing: griffe.Object) -> Iterator[griffe.Object]:
    """A module or class and everything public that is defined in it."""
    yield thing
    for name, member in thing.members.items():
        if member.is_alias or name.startswith("_"):
            continue
        if member.is_module or member.is_class:
            yield from public(member)
        elif member.is_function:
            yield member


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; the build ends with an error if there is a warning."""
    folder = tmp_path_factory.mktemp("site")
    subprocess.run([sys.executable, "-m", "mkdocs", "build", "--site-dir", str(folder)],
                   cwd=ROOT, check=True, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"})
    return folder


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_has_a_docstring(package: str) -> None:
    tree = griffe.load(package, search_paths=[ROOT / "ros2_ws/src" / package])
    assert [one.path for one in public(tree) if not one.has_docstring] == []


@pytest.mark.nightly("it reads all packages")
def test_no_page_of_the_site_loads_anything_from_elsewhere(site: Path) -> None:
    loaded = [(page.name, line) for page in site.rglob("*.html")
              for line in page.read_text(encoding="utf-8").splitlines()
              if ('src="http' in line or 'rel="stylesheet" href="http' in line)]
    assert loaded == []


@pytest.mark.nightly("it reads all packages")
def test_every_package_has_its_page_with_each_of_its_modules(site: Path) -> None:
    for package in PACKAGES:
        text = "".join(page.read_text(encoding="utf-8")
                       for page in (site / "api" / package).glob("*.html"))
        source = ROOT / "ros2_ws/src" / package / package
        names = [".".join(path.relative_to(source.parent).with_suffix("").parts)
                 for path in source.rglob("*.py") if path.name != "__init__.py"]
        assert [name for name in names if f'id="{name}"' not in text] == []

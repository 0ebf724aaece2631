"""The site of the documentation builds without a warning, and explains every public name."""

import os
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("mkdocs", reason="`make docs` installs what the site needs")
ROOT = Path(__file__).resolve().parents[1]
api = SimpleNamespace(**runpy.run_path(str(ROOT / "docs/site/api.py")))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; the build ends with an error if there is a warning."""
    folder = tmp_path_factory.mktemp("site")
    subprocess.run([sys.executable, "-m", "mkdocs", "build", "--site-dir", str(folder)],
                   cwd=ROOT, check=True, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"})
    return folder


@pytest.mark.parametrize("package", api.packages())
def test_every_public_name_has_a_docstring(package: str) -> None:
    assert api.undocumented(package) == []


def test_a_public_name_without_a_docstring_is_found(tmp_path: Path) -> None:
    (tmp_path / "some").mkdir()
    (tmp_path / "some" / "__init__.py").write_text('"""A package."""\n')
    (tmp_path / "some" / "module.py").write_text(
        '"""A module."""\n\ndef told():\n    """A function."""\n\ndef untold():\n    pass\n\n'
        'class Kind:\n    """A class."""\n    def does(self): ...\n    def _hidden(self): ...\n')
    assert api.undocumented("some", tmp_path) == ["some.module.untold", "some.module.Kind.does"]


@pytest.fixture(scope="module")
def hooks() -> SimpleNamespace:
    """The module that MkDocs calls."""
    return SimpleNamespace(**runpy.run_path(str(ROOT / "docs/site/hooks.py")))


def rewritten(hooks: SimpleNamespace, markdown: str, place: str = "tutorials/page.md") -> str:
    """The text of a page of the site as MkDocs gets it."""
    page = SimpleNamespace(file=SimpleNamespace(src_uri=place))
    return str(hooks.on_page_markdown(markdown, page, None, None))


@pytest.mark.parametrize("link", [
    "[text]({})", '[text]({} "a title")', "[text](<{}>)", "[text]({}#heading)", "![picture]({})",
    "[`code`]({})", "[over\ntwo lines]({})", "[text][name]\n\n[name]: {}",
    '[text][name]\n\n[name]: <{}> "a title"', "[text]({}) `code` [text]({})",
    "A lone ` before [text]({}).\n\nAnd ` after."])
@pytest.mark.parametrize(("target", "place"), [
    ("../../README.md", "../index.md"), ("../walking.md", "../walking.md"),
    ("../../pyproject.toml", "../files/pyproject.toml.txt")])
def test_a_link_of_a_page_leads_to_its_place_in_the_site(
    hooks: SimpleNamespace, link: str, target: str, place: str
) -> None:
    assert rewritten(hooks, link.replace("{}", target)) == link.replace("{}", place)


def test_links_of_the_readme_are_those_of_the_front_page(hooks: SimpleNamespace) -> None:
    text = "[a](docs/walking.md) and [b]\n\n[b]: docs/door.md\n"
    assert rewritten(hooks, text, "index.md") == "[a](walking.md) and [b]\n\n[b]: door.md\n"


@pytest.mark.parametrize("code", [
    "`[text](../../README.md)`", "``a ` [text](../../README.md)``", "`over\n[t](../../README.md)`",
    "```md\n[text](../../README.md)\n```", "~~~\n[name]: ../../README.md\n~~~",
    "- x\n\n  ```python\n  f[0](../../README.md)\n  ```"])
def test_code_stays_as_it_is_written(hooks: SimpleNamespace, code: str) -> None:
    link = "[text](../../README.md)"
    assert rewritten(hooks, f"{link}\n\n{code}\n\n{link}") == (
        f"[text](../index.md)\n\n{code}\n\n[text](../index.md)")


@pytest.mark.parametrize("link", [
    "[text](https://a.example/README.md)", "[text](#heading)", "[text](missing.md)",
    "[name]: https://a.example/x.md", "x[0](y)", "[text](/README.md)"])
def test_a_link_out_of_the_repository_stays_as_it_is(hooks: SimpleNamespace, link: str) -> None:
    assert rewritten(hooks, link) == link


@pytest.mark.nightly("it reads all packages")
def test_no_page_of_the_site_loads_anything_from_elsewhere(site: Path) -> None:
    loaded = [(page.name, line) for page in site.rglob("*.html")
              for line in page.read_text(encoding="utf-8").splitlines()
              if ('src="http' in line or 'rel="stylesheet" href="http' in line)]
    assert loaded == []


@pytest.mark.nightly("it reads all packages")
def test_every_package_has_its_page_with_each_of_its_modules(site: Path) -> None:
    for package in api.packages():
        text = "".join(page.read_text(encoding="utf-8")
                       for page in (site / "api" / package).glob("*.html"))
        source = ROOT / "ros2_ws/src" / package / package
        names = [".".join(path.relative_to(source.parent).with_suffix("").parts)
                 for path in source.rglob("*.py") if path.name != "__init__.py"]
        assert [name for name in names if f'id="{name}"' not in text] == []

"""README and docs: what they name, link to and import exists, and their pictures can be drawn."""

import importlib
import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "ros2_ws" / "src"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("**/*.md"))]
FILES = {path.name for folder in ("ros2_ws/src", "tests", "docs", "examples", "ros2_commands")
         for path in (ROOT / folder).rglob("*") if path.is_file()}
MADE_BY_USERS = {"my_board.py", "my_params.yaml", "my_door.yaml", "my_linkage.yaml",
                 "my_robot.yaml", "plan.png", "metadata.yaml"}
NAMED = re.compile(r"`([\w.-]+(?:/[\w.-]+)*(?:\.(?:py|yaml|toml|csv|png)|/))(?:: [^`]*)?`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
CODE = re.compile(r"^ *```.*?^ *```$|`[^`\n]+`", re.DOTALL | re.MULTILINE)


def exists(path: str) -> bool:
    """Whether a path of the docs is in the tree: from the root, from ros2_ws/src, or a package.

    `door_model/door/closer.py` stands for door_model/door_model/door/closer.py.
    """
    if path.startswith("out/") or path in MADE_BY_USERS:
        return True
    if "/" not in path:
        return path in FILES
    package, _, rest = path.partition("/")
    places = [ROOT / path, SOURCE / path, SOURCE / package / package / rest]
    return any(place.exists() for place in places)


def leads_somewhere(page: Path, link: str) -> bool:
    """Whether a link of a page leads to a file, and to a heading of it, or out of the project."""
    file, _, anchor = link.partition("#")
    target = page.parent / file if file else page
    if re.match(r"[a-z]+:", link) or not anchor:
        return ":" in link or target.exists()
    headings = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE)
    return anchor in (  # as GitHub makes the anchor of a heading
        re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_path_that_a_page_names_exists(page: Path) -> None:
    named = NAMED.findall(page.read_text(encoding="utf-8"))
    assert [path for path in named if not exists(path)] == []


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CHANGELOG.md"], ids=lambda page: page.name)
def test_every_link_of_a_page_leads_to_a_file_and_a_heading(page: Path) -> None:
    links = LINK.findall(CODE.sub("", page.read_text(encoding="utf-8")))
    assert [link for link in links if not leads_somewhere(page, link)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_the_python_code_of_a_page_imports_exists(page: Path) -> None:
    for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        for module, names in re.findall(r"^from (\w[\w.]*) import (.*)$", block, re.MULTILINE):
            for name in names.split(", "):
                if not hasattr(importlib.import_module(module), name):
                    importlib.import_module(f"{module}.{name}")


@pytest.mark.parametrize(("script", "drawn"), [
    ("docs/robot_and_door.py", "drawn.png"),
    pytest.param("docs/tutorials/hit_explained.py", "drawn",
                 marks=pytest.mark.nightly("it simulates a hit")),
])
def test_a_picture_of_the_docs_can_be_drawn_anew(script: str, drawn: str, tmp_path: Path) -> None:
    out = tmp_path / drawn
    runpy.run_path(str(ROOT / script))["main"](["--out", str(out)])
    pictures = list(out.glob("*.png")) if out.is_dir() else [out]
    assert pictures
    assert all(picture.stat().st_size > 10_000 for picture in pictures)

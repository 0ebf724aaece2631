"""README and docs: what they name exists, and what they promise to be short is short."""

import importlib
import re
import runpy
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "ros2_ws" / "src"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]
FILES = {path.name for folder in ("ros2_ws/src", "tests", "docs", "examples", "ros2_commands")
         for path in (ROOT / folder).rglob("*") if path.is_file()}
MADE_BY_USERS = {"my_board.py", "my_params.yaml", "my_door.yaml", "my_linkage.yaml",
                 "my_robot.yaml", "plan.png"}
NAMED = re.compile(r"`([\w.-]+(?:/[\w.-]+)*(?:\.(?:py|yaml|toml|csv|png)|/))(?:: [^`]*)?`")
# A link or a picture, with or without a title, and the definition of a reference.
_TITLE = r"""(?:\s+(?:"[^"]*"|'[^']*'|\([^)]*\)))?"""
LINK = re.compile(
    rf"\]\(\s*(?:<([^>\n]*)>|([^)\s]+)){_TITLE}\s*\)"
    rf"|^ {{0,3}}\[[^\]]+\]:\s*(?:<([^>\n]*)>|(\S+)){_TITLE}\s*$", re.MULTILINE)
USED = re.compile(r"\[[^\[\]]+\]\[([^\[\]]+)\]")
CODE = re.compile(
    r"^[ \t]*(?P<fence>`{3,}|~{3,})[^`\n]*\n.*?^[ \t]*(?P=fence)[ \t]*$"
    r"|(?<!`)(?P<ticks>`+)(?!`)(?:(?!\n[ \t]*\n).)*?(?<!`)(?P=ticks)(?!`)",
    re.DOTALL | re.MULTILINE)


def named_in(text: str) -> Iterator[str]:
    """Paths in backticks of a page: modules, data files, and folders with a slash at the end."""
    for path in NAMED.findall(text):
        if not path.startswith("out/") and path not in MADE_BY_USERS:
            yield path


def exists(path: str) -> bool:
    """Whether a path of the docs is in the tree: from the root, from ros2_ws/src, or a package.

    `door_model/door/closer.py` stands for door_model/door_model/door/closer.py.
    """
    if "/" not in path:
        return path in FILES
    package, _, rest = path.partition("/")
    places = [ROOT / path, SOURCE / path, SOURCE / package / package / rest]
    return any(place.exists() for place in places)


def links(text: str) -> list[str]:
    """Targets of the links of a page, code left out; a reference without a definition is one."""
    prose = CODE.sub("", text)
    found = ["".join(match) for match in LINK.findall(prose)]
    defined = {name.lower() for name in re.findall(r"^ {0,3}\[([^\]]+)\]:", prose, re.MULTILINE)}
    return found + [name for name in USED.findall(prose) if name.lower() not in defined]


def broken_links(page: Path) -> list[str]:
    """Links of a page that lead to no file, or to no heading of it."""
    broken = []
    for link in links(page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", link):
            continue
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        headings = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE) \
            if anchor and target.is_file() else []
        if not target.exists() or (anchor and anchor not in map(slug, headings)):
            broken.append(link)
    return broken


def slug(heading: str) -> str:
    """The anchor of a heading, as GitHub makes it."""
    kept = re.sub(r"[^\w\- ]", "", heading.strip().lower())
    return kept.replace(" ", "-")


def python_blocks(text: str) -> list[str]:
    """The Python code blocks of a page."""
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_path_that_a_page_names_exists(page: Path) -> None:
    missing = [path for path in named_in(page.read_text(encoding="utf-8")) if not exists(path)]
    assert not missing


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CHANGELOG.md"], ids=lambda page: page.name)
def test_every_link_of_a_page_leads_to_a_file_and_a_heading(page: Path) -> None:
    assert broken_links(page) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_the_python_code_of_a_page_imports_exists(page: Path) -> None:
    for block in python_blocks(page.read_text(encoding="utf-8")):
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

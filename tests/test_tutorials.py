"""Pages do what they say: their commands run, and print the lines that are shown."""

import os
import sys
from pathlib import Path

import pytest
import tutorial

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = [page for page in sorted(DOCS.rglob("*.md"))
         if any(block.runs for block in tutorial.blocks(page.read_text(encoding="utf-8")))]


@pytest.mark.nightly("minutes: it runs the commands of every page")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    programs = Path(sys.executable).parent  # where `ros2` is, without a sourced ROS 2
    environment = os.environ | {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    tutorial.run(page.read_text(encoding="utf-8"), tmp_path, environment)


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: page.stem)
def test_every_block_of_a_page_is_run_or_says_why_not(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    found = tutorial.blocks(text)
    unknown = [block.note for block in found
               if block.note not in ("", tutorial.FAILS, tutorial.IN_PROJECT)
               and not block.note.startswith(tutorial.NOT_RUN)]
    assert not unknown
    known = (*tutorial.SHELLS, *tutorial.PYTHONS, *tutorial.SHOWN)
    assert {block.language for block in found} <= set(known)
    fences = [line for line in text.splitlines() if line.lstrip().startswith(("```", "~~~"))]
    assert len(fences) == 2 * len(found), "a fence is not seen"

"""Pages do what they say: their commands run, and print the lines that are shown."""

import os
import sys
from pathlib import Path

import pytest
import tutorial

DOCS = tutorial.PROJECT / "docs"
PAGES = [page for page in sorted(DOCS.rglob("*.md"))
         if any(map(tutorial.is_run, tutorial.BLOCK.finditer(page.read_text(encoding="utf-8"))))]


@pytest.mark.nightly("minutes: it runs the commands of every page")
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    programs = Path(sys.executable).parent  # where `ros2` is, without a sourced ROS 2
    environment = os.environ | {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    tutorial.run(page.read_text(encoding="utf-8"), tmp_path, environment)

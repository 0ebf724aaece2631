"""The tutorials do what they say: their commands run, and print the lines that are shown."""

import os
import sys
from pathlib import Path

import pytest
import tutorial

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "tutorials"
PAGES = sorted(FOLDER.glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_tutorial_runs(page: Path, tmp_path: Path) -> None:
    programs = Path(sys.executable).parent  # where `ros2` is, without a sourced ROS 2
    environment = os.environ | {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    tutorial.run(page.read_text(encoding="utf-8"), tmp_path, environment)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_of_a_tutorial_is_run_or_says_why_not(page: Path) -> None:
    unknown = [block.note for block in tutorial.blocks(page.read_text(encoding="utf-8"))
               if block.note not in ("", tutorial.FAILS, tutorial.IN_PROJECT)
               and not block.note.startswith(tutorial.NOT_RUN)]
    assert not unknown


def test_a_line_is_shown_if_its_words_agree_and_its_numbers_nearly() -> None:
    output = "k_c   1.130 +- 0.006 N m/rad\npeak 25.0 deg"
    assert tutorial.is_shown("k_c 1.131 +- 0.006    N m/rad", output)
    assert not tutorial.is_shown("k_c 1.331 +- 0.006 N m/rad", output)
    assert not tutorial.is_shown("k_c 1.130 +- 0.006 N m s/rad", output)


@pytest.mark.parametrize(("code", "note"), [("exit 3", ""), ("true", "fails")])
def test_a_block_that_ends_otherwise_than_the_page_says_is_an_error(
    code: str, note: str, tmp_path: Path
) -> None:
    comment = f"<!-- {note} -->\n" if note else ""
    with pytest.raises(AssertionError, match="ended with"):
        tutorial.run(f"{comment}```sh\n{code}\n```\n", tmp_path, dict(os.environ))

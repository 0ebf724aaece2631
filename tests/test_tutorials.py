"""Pages do what they say: their commands run, and print the lines that are shown."""

import os
import sys
from pathlib import Path

import pytest
import tutorial

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = [page for page in sorted(DOCS.rglob("*.md"))
         if any(block.runs for block in tutorial.blocks(page.read_text(encoding="utf-8")))]


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


def run(page: str, folder: Path) -> None:
    """Run the blocks of a page in a folder."""
    tutorial.run(page, folder, dict(os.environ))


@pytest.mark.parametrize("fence", [
    "```sh\n{}\n```", "```bash\n{}\n```", "``` sh\n{}\n```", '```sh hl_lines="1"\n{}\n```',
    "1. In a list:\n   ```sh\n   {}\n   ```", "\t```bash\n\t{}\n\t```", "~~~sh\n{}\n~~~",
    "````sh\n{}\n````", "   <!-- in the project -->\n   ```sh\n   {}\n   ```"])
def test_a_block_is_seen_however_it_is_fenced(fence: str, tmp_path: Path) -> None:
    mark = tmp_path / "was_run"
    run(f"# Page\n\n{fence.format(f'touch {mark}')}\n\nThe end.\n", tmp_path)
    assert mark.exists()


def test_the_lines_of_an_indented_block_lose_its_indent_alone(tmp_path: Path) -> None:
    run("- Python:\n\n  ```python\n  if True:\n      print('one')\n\n  print('two')\n  ```\n\n"
        "  ```text\n  one\n  two\n  ```\n", tmp_path)


def test_lines_are_shown_if_their_words_agree_and_their_numbers_nearly() -> None:
    output = "k_c   1.130 +- 0.006 N m/rad\npeak 25.0 deg"
    assert tutorial.first_missing("k_c 1.131 +- 0.006    N m/rad", output) is None
    for wrong in ("k_c 1.331 +- 0.006 N m/rad", "k_c 1.130 +- 0.006 N m s/rad"):
        assert tutorial.first_missing(wrong, output) == wrong


@pytest.mark.parametrize(("shown", "printed", "same"), [
    ("5 swings", "5 swings", True), ("5 swings", "6 swings", False),
    ("100 runs", "101 runs", False), ("0 falls", "1 falls", False),
    ("-3 counts", "3 counts", False),
    ("25.0 deg", "25.1 deg", True), ("25 deg", "25.1 deg", True), ("25 deg", "28.0 deg", False),
    ("1509 N", "1502 N", True), ("1509 N", "1402 N", False), ("3 mm", "4 mm", True),
    ("3 mm", "5 mm", False),
    ("0.0 mm", "0.1 mm", True), ("0.0 mm", "0.2 mm", False), ("code 0, 1.00 s", "code 1, 1.00 s",
                                                              False)])
def test_whole_numbers_are_shown_as_they_are(shown: str, printed: str, same: bool) -> None:
    assert (tutorial.first_missing(shown, printed) is None) == same


@pytest.mark.parametrize("order", ["a\nc", "a\nb\nc", "c\nc", "a\na\nc"])
def test_lines_are_shown_in_the_order_in_which_they_are_printed(order: str) -> None:
    output = "a\na\nb\nc\nc"
    assert tutorial.first_missing(order, output) is None
    backwards = "\n".join(reversed(order.splitlines()))
    if backwards != order:
        assert tutorial.first_missing(backwards, output) is not None
    assert tutorial.first_missing("b\nb", output) == "b"


@pytest.mark.parametrize(("code", "note"), [("exit 3", ""), ("true", "fails")])
def test_a_block_that_ends_otherwise_than_the_page_says_is_an_error(
    code: str, note: str, tmp_path: Path
) -> None:
    comment = f"<!-- {note} -->\n" if note else ""
    with pytest.raises(AssertionError, match="ended with"):
        run(f"{comment}```sh\n{code}\n```\n\n```text\nerror\n```\n", tmp_path)


def test_a_block_fails_with_the_error_that_the_page_shows(tmp_path: Path) -> None:
    failing = "<!-- fails -->\n```sh\necho refused >&2; exit 1\n```\n"
    run(f"{failing}\n```text\nrefused\n```\n", tmp_path)
    with pytest.raises(AssertionError, match="shows 'too fast'"):
        run(f"{failing}\n```text\ntoo fast\n```\n", tmp_path)
    with pytest.raises(AssertionError, match="does not show the error"):
        run(f"{failing}\n```sh\ntrue\n```\n", tmp_path)
    with pytest.raises(AssertionError, match="does not show the error"):
        run(failing, tmp_path)

"""Runs the code of a page of the docs in an empty folder, as its reader would.

Blocks of `sh` and `bash` are run by bash, blocks of `python` by Python, and a block with a title is
written to the file of that name; blocks in lists are indented. A comment before a block changes
this: `<!-- not run: reason -->` leaves it out, `<!-- fails -->` expects the command to end with the
error that the next block shows, and `<!-- in the project -->` runs it in the project's folder. A
block of `text` shows lines of the output of the block before it, in their order.
"""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
FAILS, IN_PROJECT, NOT_RUN = "fails", "in the project", "not run: "  # comments before a block
SHELLS, PYTHONS = ("sh", "bash"), ("python", "py")  # languages of the blocks that are run
SHOWN = ("", "text", "yaml", "json", "mermaid")  # languages of the blocks that only show something
_BLOCK = re.compile(
    r"^(?P<indent>[ \t]*)(?:<!-- (?P<note>[^\n]*?) -->\n(?P=indent))?"
    r"(?P<fence>`{3,}|~{3,}) *(?P<language>[^\s`]*)(?P<options>[^\n`]*)\n"
    r"(?P<code>.*?)^[ \t]*(?P=fence)[ \t]*$", re.DOTALL | re.MULTILINE)
_TITLE = re.compile(r"title=\"([^\"]+)\"")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_UNIT = re.compile(r" ?(?:N|mm|ms|deg|Hz|kg|%|m/s)(?!\w)")  # of a number that is measured
_SECONDS = 120  # time in which a block must end; only a command that hangs takes so long


@dataclass(frozen=True)
class Block:
    """A fenced block of a page.

    Attributes:
        language: Language behind the fence, e.g. "sh".
        code: Its lines.
        title: Name of the file that it shows; empty for none.
        note: Comment before it, without the brackets; empty for none.
    """

    language: str
    code: str
    title: str = ""
    note: str = ""

    @property
    def runs(self) -> bool:
        """Whether the block is run or written."""
        return not self.note.startswith(NOT_RUN) and bool(
            self.title or self.language in SHELLS + PYTHONS)


def blocks(page: str) -> list[Block]:
    """The fenced blocks of a page, in their order."""
    return [_block(found) for found in _BLOCK.finditer(page)]


def _block(found: re.Match[str]) -> Block:
    title = _TITLE.search(found["options"])
    lines = [line.removeprefix(found["indent"]) for line in found["code"].splitlines(keepends=True)]
    return Block(found["language"], "".join(lines), title[1] if title else "", found["note"] or "")


def run(page: str, folder: Path, environment: dict[str, str]) -> None:
    """Run the blocks of a page in an empty folder.

    Raises:
        AssertionError: A block ends otherwise than it should, or its output does not have the lines
            that the page shows, in their order.
    """
    output = ""
    found = blocks(page)
    for block, after in zip(found, [*found[1:], Block("", "")], strict=True):
        assert block.note != FAILS or (after.language == "text" and after.code.strip()), (
            f"the page does not show the error of:\n{block.code}")
        if block.language == "text":
            missing = first_missing(block.code, output)
            assert missing is None, f"the page shows {missing!r}, the output is:\n{output}"
        elif not block.runs:
            output = ""
        elif block.title:
            (folder / block.title).write_text(block.code, encoding="utf-8")
        else:
            output = _output(block, PROJECT if block.note == IN_PROJECT else folder, environment)


def first_missing(shown: str, output: str) -> str | None:
    """The first of the lines that an output does not have behind those before it; None for none.

    A line agrees if its words do, and its numbers to 5 %; whole numbers without a unit must be the
    same.
    """
    left = iter(output.splitlines())
    for line in filter(str.strip, shown.splitlines()):
        wanted = _words(line)
        if not any(_words(found) == wanted and _agree(line, found) for found in left):
            return line
    return None


def _words(line: str) -> list[str]:
    return _NUMBER.sub("0", line).split()


def _agree(line: str, found: str) -> bool:
    pairs = zip(_NUMBER.finditer(line), _NUMBER.findall(found), strict=True)
    return all(abs(float(one[0]) - float(other)) <= _tolerance(one, other) for one, other in pairs)


def _tolerance(one: re.Match[str], other: str) -> float:
    """0 for whole numbers that count something; else 5 % and one unit of the last digit."""
    digits = len(one[0].partition(".")[2])
    measured = _UNIT.match(one.string, one.end()) is not None
    if not digits and "." not in other and not measured:
        return 0.0
    return 0.05 * abs(float(one[0])) + float(10.0 ** -digits if digits or measured else 0.0)


def _output(block: Block, folder: Path, environment: dict[str, str]) -> str:
    shell = [sys.executable, "-c"] if block.language in PYTHONS else [
        "bash", "-e", "-o", "pipefail", "-c"]
    done = subprocess.run([*shell, block.code], cwd=folder, env=environment, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=_SECONDS)
    assert (done.returncode != 0) == (block.note == FAILS), (
        f"ended with {done.returncode}:\n{block.code}\n{done.stdout}")
    return done.stdout

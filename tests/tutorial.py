"""Runs the code of a page of the docs in an empty folder, as its reader would.

Blocks of `sh` are run by bash, blocks of `python` by Python, and a block with a title is written to
the file of that name. A comment before a block changes this: `<!-- not run: reason -->` leaves it
out, `<!-- fails -->` expects the command to end with an error, and `<!-- in the project -->` runs
it in the project's folder. A block of `text` shows lines of the output of the block before it.
"""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
FAILS, IN_PROJECT, NOT_RUN = "fails", "in the project", "not run: "  # comments before a block
_BLOCK = re.compile(
    r"^(?:<!-- (?P<note>[^\n]*?) -->\n)?```(?P<language>\w*)(?: title=\"(?P<title>[^\"]+)\")?\n"
    r"(?P<code>.*?)^```$", re.DOTALL | re.MULTILINE)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
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
            self.title or self.language in ("sh", "python"))


def blocks(page: str) -> list[Block]:
    """The fenced blocks of a page, in their order."""
    return [Block(found["language"], found["code"], found["title"] or "", found["note"] or "")
            for found in _BLOCK.finditer(page)]


def run(page: str, folder: Path, environment: dict[str, str]) -> None:
    """Run the blocks of a page in an empty folder.

    Raises:
        AssertionError: A block ends otherwise than it should, or a line that the page shows is not
            in its output.
    """
    output = ""
    for block in blocks(page):
        if block.language == "text":
            missing = [line for line in block.code.splitlines()
                       if line and not is_shown(line, output)]
            assert not missing, f"the page shows {missing}, the output is:\n{output}"
        elif not block.runs:
            output = ""
        elif block.title:
            (folder / block.title).write_text(block.code, encoding="utf-8")
        else:
            output = _output(block, PROJECT if block.note == IN_PROJECT else folder, environment)


def is_shown(line: str, output: str) -> bool:
    """Whether an output has a line with these words, and with numbers that agree to 5 %."""
    wanted = _words(line)
    return any(_words(found) == wanted and _agree(line, found) for found in output.splitlines())


def _words(line: str) -> list[str]:
    return _NUMBER.sub("0", line).split()


def _agree(line: str, found: str) -> bool:
    pairs = zip(_NUMBER.findall(line), _NUMBER.findall(found), strict=True)
    return all(abs(float(one) - float(other)) <= 0.05 * abs(float(one)) + _step(one)
               for one, other in pairs)


def _step(number: str) -> float:
    """One unit of a number's last digit."""
    return float(10.0 ** -len(number.partition(".")[2]))


def _output(block: Block, folder: Path, environment: dict[str, str]) -> str:
    shell = ["bash", "-e", "-o", "pipefail", "-c"] if block.language == "sh" else [
        sys.executable, "-c"]
    done = subprocess.run([*shell, block.code], cwd=folder, env=environment, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=_SECONDS)
    assert (done.returncode != 0) == (block.note == FAILS), (
        f"ended with {done.returncode}:\n{block.code}\n{done.stdout}")
    return done.stdout

"""Runs the code of a page of the docs in an empty folder, as its reader would.

Blocks of `sh` are run by bash, blocks of `python` by Python, and a block with a title is written to
the file of that name. A comment before a block changes this: `<!-- not run: reason -->` leaves it
out, `<!-- fails -->` expects the command to end with the error that the next block shows, and
`<!-- in the project -->` runs it in the project's folder. A block of `text` shows lines of the
output of the block before it, in their order.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
SHELLS = {"sh": ["bash", "-e", "-o", "pipefail", "-c"], "python": [sys.executable, "-c"]}
BLOCK = re.compile(
    r"^(?:<!-- (?P<note>[^\n]*) -->\n)?```(?P<language>\w*)(?: title=\"(?P<title>[^\"]+)\")?\n"
    r"(?P<code>.*?)^```$", re.DOTALL | re.MULTILINE)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_SECONDS = 120  # time in which a block must end; only a command that hangs takes so long


def is_run(block: re.Match[str]) -> bool:
    """Whether a block is run; a note that is none of the known ones is an error."""
    note = block["note"] or ""
    assert note in ("", "fails", "in the project") or note.startswith("not run: "), note
    return block["language"] in SHELLS and not note.startswith("not run: ")


def run(page: str, folder: Path, environment: dict[str, str]) -> None:
    """Run the blocks of a page in an empty folder.

    Raises:
        AssertionError: A block ends otherwise than it should, or its output does not have the lines
            that the page shows, in their order.
    """
    output = ""
    for block in BLOCK.finditer(page):
        if block["title"]:
            (folder / block["title"]).write_text(block["code"], encoding="utf-8")
        elif block["language"] == "text":
            missing = first_missing(block["code"], output)
            assert missing is None, f"the page shows {missing!r}, the output is:\n{output}"
        elif is_run(block):
            done = subprocess.run(
                [*SHELLS[block["language"]], block["code"]], env=environment, text=True,
                cwd=PROJECT if block["note"] == "in the project" else folder,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=_SECONDS, check=False)
            output = done.stdout
            assert (done.returncode != 0) == (block["note"] == "fails"), (
                f"ended with {done.returncode}:\n{block['code']}\n{output}")


def first_missing(shown: str, output: str) -> str | None:
    """The first of the lines that an output does not have behind those before it; None for none.

    A line agrees if its words do, and its numbers to one unit of the last digit shown.
    """
    left = iter(output.splitlines())
    for line in filter(str.strip, shown.splitlines()):
        if not any(_agree(line, found) for found in left):
            return line
    return None


def _agree(line: str, found: str) -> bool:
    if _NUMBER.sub("0", line).split() != _NUMBER.sub("0", found).split():
        return False
    pairs = zip(_NUMBER.findall(line), _NUMBER.findall(found), strict=True)
    return all(abs(float(one) - float(other)) < 1.01 * 10.0 ** -len(one.partition(".")[2])
               for one, other in pairs)

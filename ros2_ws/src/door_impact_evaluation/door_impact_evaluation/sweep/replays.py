"""Replays of a sweep's worst runs: a self-contained page of each."""

import hashlib
import html
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from door_impact_common.files import write_whole
from door_impact_view.replay.page import page

from door_impact_evaluation.sweep.kind import REPLAYS, BadRun, Case, Kind

_MARK = "<!-- a sweep's run: "  # before the digest that a page of a sweep contains


@dataclass(frozen=True)
class Order:
    """A replay that is to be made.

    Attributes:
        kind: Kind of the sweep.
        run: The run.
        case: Its case.
        engine: Physics engine of the simulation.
        path: Page to write.
        key: Digest of everything that determines the run; the page contains it.
    """

    kind: Kind
    run: BadRun
    case: Case
    engine: str
    path: Path
    key: str


def orders(
    kind: Kind, bad: Iterable[BadRun], cases: Iterable[Case], out: Path, engine: str, digest: str
) -> list[Order]:
    """Finds the replays that are missing, and removes pages of other runs from their folder.

    Args:
        kind: Kind of the sweep.
        bad: The bad runs.
        cases: Cases of the sweep.
        out: Folder of the sweep's results.
        engine: Physics engine of the simulation.
        digest: Digest of the code.
    """
    folder, named = out / REPLAYS, {case.name: case for case in cases}
    folder.mkdir(exist_ok=True)
    wanted = []
    for run in bad:
        case, path = named[run.name], folder / run.file
        content = json.dumps([digest, kind.name, engine, case.as_json(), run.number, run.why],
                             sort_keys=True)
        key = hashlib.sha256(content.encode()).hexdigest()
        wanted.append(Order(kind, run, case, engine, path, key))
    kept = {order.path for order in wanted}
    for page_path in folder.glob("*.html"):
        if page_path not in kept and _MARK in _text(page_path):
            page_path.unlink()
    return [order for order in wanted if order.key not in _text(order.path)]


def _text(path: Path) -> str:
    """Reads a page; what is no text is read as something else, and so is not taken for one."""
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def make(order: Order) -> None:
    """Runs a bad run again, and writes its page.

    Args:
        order: The order.

    Raises:
        SimBridgeError: The simulation failed.
        OutputError: The page cannot be written.
    """
    run = order.run
    replay = order.kind.replay(order.case, order.engine, run.number)
    title = f"{run.name}, {order.kind.part} {run.number + 1}: {run.why}"
    settings = "; ".join(f"{name} {_short(value)}" for name, value in order.case.as_json().items())
    write_whole(order.path, page(
        title, replay, before=f"<h1>{html.escape(title)}</h1>{_MARK}{order.key} -->",
        after=f"<p>The case, in {order.engine}: {html.escape(settings)}.</p>"))


def _short(value: Any) -> str:
    """Formats a setting of a case for people."""
    if isinstance(value, list):
        return ", ".join(map(_short, value)) or "none"
    return f"{value:.4g}" if isinstance(value, float) else str(value)

"""Replays of a sweep's worst runs: which runs these are, and a self-contained page of each."""

import hashlib
import html
import json
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from door_impact_common.files import write_whole
from door_impact_view.replay.page import page

from door_impact_evaluation.run.rehearsal import Rehearsal
from door_impact_evaluation.sweep.cases import Case
from door_impact_evaluation.sweep.hits import hits

FOLDER = "replays"
"""Folder of the replays below that of the sweep's results."""
_MARK = "<!-- a sweep's run: "  # before the digest that a page of a sweep contains
ERRORS, MARGINS, FALLEN = 2, 2, 3  # most runs that are shown for each reason


@dataclass(frozen=True)
class BadRun:
    """A run that is worth looking at.

    Attributes:
        name: Name of the case.
        hit: Number of the hit, from 0.
        why: What is bad about it.
        file: Name of its replay in `FOLDER`.
    """

    name: str
    hit: int
    why: str
    file: str


@dataclass(frozen=True)
class Order:
    """A replay that is to be made.

    Attributes:
        run: The run.
        case: Its case.
        engine: Physics engine of the simulation.
        path: Page to write.
        key: Digest of everything that determines the run; the page contains it.
    """

    run: BadRun
    case: Case
    engine: str
    path: Path
    key: str


def worst(records: list[dict[str, Any]]) -> list[BadRun]:
    """Chooses the runs with a replay; a run with several faults is named once, with all of them.

    These are up to `FALLEN` runs in which the robot did not stand or missed the door, the `ERRORS`
    runs with the largest error of the angle, and the `MARGINS` runs with the smallest ZMP margin.

    Args:
        records: Records of the sweep.
    """
    done = [record for record in records if "refused" not in record]
    hit = [record for record in done if "error_deg" in record]
    lost = [(record, "the robot did not stand" if not record["stood"] else "no contact")
            for record in done if not record["stood"] or "error_deg" not in record]
    far = [(record, f"largest angle {record['error_deg']:+.2f} deg from the desired one")
           for record in sorted(hit, key=lambda record: -abs(record["error_deg"]))]
    near = [(record, "ZMP margin {:.0f} mm in {}".format(*_margin(record)))
            for record in sorted(hit, key=_margin)]
    reasons: dict[tuple[str, int], list[str]] = {}
    for record, why in [*lost[:FALLEN], *far[:ERRORS], *near[:MARGINS]]:
        reasons.setdefault((record["name"], record["hit"]), []).append(why)
    return [BadRun(name, number, "; ".join(whys), f"{name}-hit{number + 1}.html")
            for (name, number), whys in reasons.items()]


def _margin(record: dict[str, Any]) -> tuple[float, str]:
    """Returns the smallest ZMP margin of a run [mm] and its phase."""
    return min((margin, phase) for phase, margin in record["margin_mm"].items())


def orders(
    bad: Iterable[BadRun], cases: Iterable[Case], out: Path, engine: str, digest: str
) -> list[Order]:
    """Finds the replays that are missing, and removes pages of other runs from their folder.

    Args:
        bad: The bad runs.
        cases: Cases of the sweep.
        out: Folder of the sweep's results.
        engine: Physics engine of the simulation.
        digest: Digest of the code.
    """
    folder, named = out / FOLDER, {case.name: case for case in cases}
    folder.mkdir(exist_ok=True)
    wanted = []
    for run in bad:
        case, path = named[run.name], folder / run.file
        content = json.dumps([digest, engine, case.as_json(), run.hit, run.why], sort_keys=True)
        key = hashlib.sha256(content.encode()).hexdigest()
        wanted.append(Order(run, case, engine, path, key))
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
    from door_impact_evaluation.report.rehearsal_replay import replay_of_rehearsal

    found = next(islice(hits(order.case, order.engine), order.run.hit, None))
    if not isinstance(found, Rehearsal):
        raise found
    replay = replay_of_rehearsal(found, order.case.config())
    title = f"{order.run.name}, hit {order.run.hit + 1}: {order.run.why}"
    settings = "; ".join(f"{name} {_short(value)}" for name, value in order.case.as_json().items())
    write_whole(order.path, page(
        title, replay, before=f"<h1>{html.escape(title)}</h1>{_MARK}{order.key} -->",
        after=f"<p>The case, in {order.engine}: {html.escape(settings)}.</p>"))


def _short(value: Any) -> str:
    """Formats a setting of a case for people."""
    if isinstance(value, list):
        return ", ".join(map(_short, value)) or "none"
    return f"{value:.4g}" if isinstance(value, float) else str(value)

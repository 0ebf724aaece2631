"""Write report.html: replay, table and every picture of a demonstration in one file."""

import html
from collections.abc import Sequence
from pathlib import Path

from door_impact_common.files import write_whole
from door_impact_view.replay.page import page, picture
from door_impact_view.replay.recording import Replay

from door_impact_evaluation.report.table import NOTES, Row

PICTURES = (
    ("impact.gif",
     "Run-up, impact, opening of the door, and what the robot does then."),
    ("door_angle.png",
     "Opening angle of the door after the impact, and the desired angle (the paper's Fig. 9)."),
    ("zmp.png",
     "ZMP from the two foot sensors, in the support polygon (the paper's Fig. 8)."),
    ("identification.png",
     "Swings of the door after pushes by hand, and eq. (1) fitted to them (the paper's Fig. 11)."),
    ("restoring_torque.png", "Restoring torque of the closer (the paper's Fig. 16)."),
    ("closer_angle.png",
     "Angle of the closer over the angle of the door (the paper's Fig. 15)."),
    ("cam_curve.png",
     "The cam curve MCV50; its first half is the run-up mcv50 (the paper's Fig. 6)."),
)
RECORDING = "run.mcap"
OTHERS = (
    ("summary.json", "every number, with the parameters found and the versions of the software"),
    ("simulation.npz", "the simulation's own 1 kHz log"),
    (RECORDING, "every topic of the run, for Foxglove and <code>ros2 bag</code>; a layout is in "
                "<code>door_impact_bringup/foxglove</code>"),
)
FILES = (*(name for name, _ in (*PICTURES, *OTHERS)), "report.html")
"""Files that a demonstration writes, without the nodes' log."""


def write(rows: Sequence[Row], heading: str, notes: Sequence[str], replay: Replay,
          path: Path) -> None:
    """Write the page, which contains the pictures in its folder; a missing one is left out.

    Args:
        rows: Rows of the table.
        heading: Sentence that says what was done and how it ended.
        notes: Warnings of identification, plan and simulation.
        replay: The motion.
        path: File to write.

    Raises:
        InputError: A picture cannot be read.
        OutputError: The page cannot be written.
    """
    pictures = "".join(picture(path.with_name(name), text) for name, text in PICTURES
                       if path.with_name(name).exists())
    write_whole(path, page(
        "hrp2_door_impact: demo", replay,
        before=f"<h1>Opening a door by an impact</h1><p>{html.escape(heading)}</p>",
        after=f"{_table(rows)}{_warnings(notes)}<h2>Figures</h2>{pictures}{_others(path)}"))


def _table(rows: Sequence[Row]) -> str:
    cells = "".join(
        f"<tr><td>{html.escape(row.name)}</td><td class=n>{html.escape(row.paper)}</td>"
        f"<td class=n>{html.escape(row.measured)}</td><td>{html.escape(row.unit)}</td></tr>"
        for row in rows)
    return ("<h2>The paper's figures and the measured ones</h2>"
            "<div class=wide><table><tr><th>quantity</th><th class=n>paper</th>"
            f"<th class=n>measured</th><th>unit</th></tr>{cells}</table></div>"
            f"<p>{html.escape(' '.join(NOTES))}</p>")


def _warnings(notes: Sequence[str]) -> str:
    items = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    return f"<p>Warnings:</p><ul>{items}</ul>" if items else ""


def _others(path: Path) -> str:
    recorded = path.with_name(RECORDING).exists()
    items = "".join(f'<li><a href="{name}">{name}</a>: {text}</li>' for name, text in OTHERS
                    if recorded or name != RECORDING)
    return f"<p>Files that were written into the same folder:</p><ul>{items}</ul>"

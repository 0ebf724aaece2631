"""Writes report.html: the table and every picture of a demonstration on one page."""

import html
from collections.abc import Sequence
from pathlib import Path

from door_impact_bringup.mcap_file import partial_folder

from door_impact_evaluation.report.table import NOTES, Row

_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;margin:1rem 0}
td,th{padding:.25rem .8rem;border-bottom:1px solid #ddd}
th{text-align:left}th.n,td.n{text-align:right;font-variant-numeric:tabular-nums}
figure{margin:1.5rem 0}img{max-width:100%}figcaption{color:#555}
"""

PICTURES = (
    ("impact.gif",
     "The hit at half speed: run-up, impact, opening of the door and hold or retreat."),
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


def write(rows: Sequence[Row], heading: str, notes: Sequence[str], path: Path) -> None:
    """Writes the page into the folder of its pictures; it links the recording if there is one.

    Args:
        rows: Rows of the table.
        heading: Sentence that says what was done and how it ended.
        notes: Warnings of identification, plan and simulation.
        path: File to write.
    """
    cells = "".join(
        f"<tr><td>{html.escape(row.name)}</td><td class=n>{html.escape(row.paper)}</td>"
        f"<td class=n>{html.escape(row.measured)}</td><td>{html.escape(row.unit)}</td></tr>"
        for row in rows)
    pictures = "".join(
        f'<figure><img src="{name}" alt="{html.escape(text)}"><figcaption>{html.escape(text)}'
        "</figcaption></figure>" for name, text in PICTURES)
    remarks = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    remarks = f"<p>Warnings:</p><ul>{remarks}</ul>" if remarks else ""
    recording = path.with_name(RECORDING)
    recorded = recording.exists() or partial_folder(recording).exists()  # it may still grow
    others = "".join(f'<li><a href="{name}">{name}</a>: {text}</li>' for name, text in OTHERS
                     if recorded or name != RECORDING)
    path.write_text(
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width"><title>hrp2_door_impact: demo</title>'
        f"<style>{_STYLE}</style><h1>Opening a door by an impact</h1><p>{html.escape(heading)}</p>"
        "<table><tr><th>quantity</th><th class=n>paper</th><th class=n>measured</th>"
        "<th>unit</th></tr>"
        f"{cells}</table><p>{html.escape(' '.join(NOTES))}</p>{remarks}{pictures}"
        f"<p>Files in the same folder:</p><ul>{others}</ul></html>\n",
        encoding="utf-8")

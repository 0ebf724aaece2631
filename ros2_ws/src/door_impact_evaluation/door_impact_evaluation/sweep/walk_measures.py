"""What is measured of a simulated walk, in a record of a sweep."""

import math

from door_impact_evaluation.run.walk_run import Walked
from door_impact_evaluation.sweep.kind import Record
from door_impact_evaluation.sweep.numbers import goodness, shown

FALLEN, MARGINS = 3, 2  # most runs of a sweep that are shown because of a fall, or their margin


def walk_record(walked: Walked) -> Record:
    """Returns the figures of a walk.

    Args:
        walked: The walk.

    Returns:
        SI units, but mm and deg where a key says so. Where the robot fell, its end is None.
    """
    off = walked.off
    end = {"ahead_mm": 1e3 * off.x, "left_mm": 1e3 * off.y, "yaw_deg": math.degrees(off.yaw)}
    return {
        "stood": walked.stood,
        "outcome": walked.execution.outcome.value,
        "changed_steps": walked.execution.recovered,
        "fell": walked.log.fell,
        "end": end if walked.stood else None,
        "off_mm": 1e3 * math.hypot(off.x, off.y) if walked.stood else None,
        "margin_mm": 1e3 * walked.margin,
        "tilt_deg": math.degrees(walked.max_tilt),
        "speed_share": walked.speed_share,
        "steps": len(walked.plan.footsteps),
        "planned_margin_mm": 1e3 * float(walked.plan.checks.margin.min()),
    }


def falls_and_margins(records: list[Record]) -> list[tuple[Record, str]]:
    """Returns falls, and runs with the smallest ZMP margins, with what is bad about them.

    Args:
        records: Records of a sweep, with "stood", "fell" and "margin_mm".
    """
    done = [record for record in records if "refused" not in record]
    fell = [(record, f"fell: {record['fell']}") for record in done if not record["stood"]]
    near = [(record, f"ZMP margin {shown(record['margin_mm'])} mm")
            for record in sorted((record for record in done if record["stood"]),
                                 key=lambda record: goodness(record["margin_mm"]))]
    return fell[:FALLEN] + near[:MARGINS]


def worst_line(record: Record) -> str:
    """Returns the line of a table for a run that fell or was refused."""
    what = f"refused: {record['refused']}" if "refused" in record else f"fell: {record['fell']}"
    return f"  {record['name']}: {what}"

"""Make the table of a demonstration: the paper's figures and the measured ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

NOTES = ("A dash means that the paper gives no figure, or that there is nothing to measure.",
         "The paper's m_re of 47.92 kg follows from its eqs. (3) and (5).")
"""Sentences below the table."""

OPENED = 0.1
"""Angle above which the door has opened [deg]."""
_INSIDE = 1.0  # ZMP margin above which the ZMP counts as inside, not on the edge [mm]
_UNIT_WIDTH = 12  # width of the column of units [characters]


@dataclass(frozen=True)
class Row:
    """A row of the table.

    Attributes:
        name: Name of the quantity.
        paper: Figure of the paper; a dash if the paper gives none.
        measured: Measured figure; a dash if there is none.
        unit: Unit of both figures.
    """

    name: str
    paper: str
    measured: str
    unit: str


def rows(summary: Mapping[str, Any], caught_deg: float) -> list[Row]:
    """Make the rows of the table.

    Args:
        summary: Contents of summary.json.
        caught_deg: Smallest angle to which the door fell back before the hand stopped it [deg].
    """
    plan, hit = summary["plan"], summary["impact"]
    door, robot = summary["door"], summary["robot"]
    loads, latency = robot["gear_load"], hit["switch_latency_ms"]
    joint = max(loads, key=loads.__getitem__)
    margins = summary["zmp"]["measured_min_margin_mm"]
    phase = min(margins, key=margins.__getitem__)
    margin = margins[phase]
    place = "inside" if margin > _INSIDE else "on the edge" if margin > -_INSIDE else "outside"
    nominal = door["target_deg"] == 25.0
    opened, passes = door["peak_deg"] > OPENED, summary["passage"] is not None
    holds = door["held_deg"] is not None and not passes  # on the way through it is only caught
    return [
        *_identified(summary["identified"]),
        Row("robot: moment of inertia I_rob", "6.147", f"{plan['i_rob']:.3f}", "kg m²"),
        Row("robot: height of the CoM b_r", "0.71", f"{plan['b_r']:.3f}", "m"),
        Row("robot: height of B above the CoM a_r", "-", f"{plan['a_r']:.3f}", "m"),
        Row("distance from the hinge to B l_B", "0.42", f"{plan['l_b']:.3f}", "m"),
        Row("effective mass m_re by eq. (3)", "47.92",
            f"{plan['effective_mass_planar']:.1f}", "kg"),
        Row("effective mass that the plan uses", "-", f"{plan['effective_mass']:.1f}", "kg"),
        Row("door speed after the hit w', planned", "-", f"{plan['omega_door']:.3f}", "rad/s"),
        Row("door speed after the hit w', measured", "-",
            f"{hit['omega_door_measured']:.3f}" if opened else "-", "rad/s"),
        Row("speed of B before the hit v_rB, planned", "-", f"{plan['v_rb']:.3f}", "m/s"),
        Row("speed of B before the hit v_rB, measured", "-",
            f"{hit['v_rb_measured']:.3f}", "m/s"),
        Row(f"largest load of a gear in the hit, {joint}", "-",
            f"{100.0 * loads[joint]:.0f}", "% of its peak torque"),
        Row("force of the arm on the trunk", "-", f"{hit['pad_force_n']:.0f}", "N"),
        Row("contact to slowing down of the legs", "-",
            "-" if latency is None else f"{latency:.1f}", "ms"),
        Row("contacts before the door's peak", "1", f"{hit['contacts_before_peak']}", ""),
        Row("desired opening angle", "25" if nominal else "-", f"{door['target_deg']:g}", "deg"),
        Row("largest opening angle", "26.3 (simulation)" if nominal else "-",
            f"{door['peak_deg']:.2f}" if opened else "-", "deg"),
        Row("error: largest less desired angle", "<= 2 (experiment)",
            f"{door['error_deg']:+.2f}" if opened else "-", "deg"),
        *([Row("angle at which the hand stops the closing door", "-",
               f"{caught_deg:.1f}" if opened else "-", "deg")] if passes or holds else []),
        *([Row("angle at which the hand holds the door", "25" if nominal else "-",
               f"{door['held_deg']:.2f}" if opened else "-", "deg")] if holds else []),
        Row("ZMP (20 ms mean) in the support polygon", "inside", place, ""),
        Row(f"smallest ZMP margin, in phase {phase}", "-", f"{margin:.1f}", "mm"),
        Row("slip of the feet", "avoided", f"{robot['foot_slip_mm']:.2f}", "mm"),
        *_passage(summary["passage"]), *_ended(summary),
    ]


def push_rows(summary: Mapping[str, Any]) -> list[Row]:
    """Make the rows of a run in which the robot pushed the door and walked through it.

    Args:
        summary: Contents of summary.json.
    """
    return [*_identified(summary["identified"]), *_passage(summary["passage"]), *_ended(summary)]


def _passage(found: Mapping[str, Any] | None) -> list[Row]:
    """Make the rows of a passage; none if the robot was not to walk through the door."""
    return [] if found is None else [
        Row(name, "-", "-" if found[key] is None else f"{found[key]:.{digits}f}", unit)
        for name, key, digits, unit in (
            ("first motion to clear of the door", "time_s", 1, "s"),
            ("steps through the door", "steps", 0, ""),
            ("largest force of the hand on the leaf", "hand_force_n", 1, "N"),
            ("error: largest of the leaf's angle against the plan", "leaf_angle_error_deg", 1,
             "deg"),
            ("smallest distance from leaf and frame", "min_clearance_mm", 1, "mm"),
            ("smallest ZMP margin in the passage", "min_margin_mm", 1, "mm"))]


def _identified(found: Mapping[str, Any]) -> list[Row]:
    def value(key: str, digits: int) -> str:
        return f"{found[key]['value']:.{digits}f} ± {found[key]['std']:.{digits}f}"

    return [
        Row("door: moment of inertia I_A", "12.75", value("i_a", 2), "kg m²"),
        Row("closer: viscosity c_c", "0.06", value("c_c", 4), "N m s/rad"),
        Row("closer: spring k_c", "1.13", value("k_c", 3), "N m/rad"),
        Row("closer: torque tau'_c0", "-", value("tau_c0_prime", 3), "N m"),
    ]


def _ended(summary: Mapping[str, Any]) -> list[Row]:
    return [
        Row("robot at the end", "stands", "fell" if summary["robot"]["fell"] else "stands", ""),
        Row("physics engine of the simulation", "-", summary["run"]["engine"], ""),
    ]


def text(lines: Sequence[Row]) -> str:
    """Format the table for a terminal.

    Args:
        lines: Rows of the table.
    """
    header = Row("", "paper", "measured", "")
    widths = [max(len(getattr(row, key)) for row in (header, *lines))
              for key in ("name", "paper", "measured")]
    rule = "-" * (sum(widths) + 4 + _UNIT_WIDTH)

    def line(row: Row) -> str:
        return (f"{row.name:<{widths[0]}}  {row.paper:>{widths[1]}}  "
                f"{row.measured:>{widths[2]}}  {row.unit}").rstrip()

    return "\n".join([rule, line(header), rule, *map(line, lines), rule, *NOTES])

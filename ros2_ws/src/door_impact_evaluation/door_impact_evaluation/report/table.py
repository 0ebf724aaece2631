"""The table of the demonstration: the paper's figure beside the measured one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """A line of the table; `paper` is a dash where the paper gives no figure."""

    name: str
    paper: str
    measured: str
    unit: str


def rows(summary: Mapping[str, Any], caught_deg: float) -> list[Row]:
    """The lines of the table.

    Args:
        summary: As written to summary.json.
        caught_deg: How far the door fell back until the hand stopped it [deg].
    """
    door, plan, hit = summary["door"], summary["plan"], summary["impact"]
    found, zmp, robot = summary["identified"], summary["zmp"], summary["robot"]
    margins = zmp["measured_min_margin_mm"]
    phase = min(margins, key=margins.__getitem__)
    margin = margins[phase]

    def value(key: str, digits: int) -> str:
        return f"{found[key]['value']:.{digits}f} ± {found[key]['std']:.{digits}f}"

    joint, (carried, motor) = max(
        ((name, (row["carried_nms"], row["motor_could_nms"]))
         for name, row in hit["braced_joints"].items()), key=lambda entry: entry[1][0])
    target = f"{door['target_deg']:g}"
    nominal, held = door["target_deg"] == 25.0, door["held_deg"] is not None
    late = hit["switch_latency_ms"]
    lines = [
        Row("door: moment of inertia I_A", "12.75", value("i_a", 2), "kg m²"),
        Row("closer: viscosity c_c", "0.06", value("c_c", 4), "N m s/rad"),
        Row("closer: spring k_c", "1.13", value("k_c", 3), "N m/rad"),
        Row("closer: torque tau'_c0", "-", value("tau_c0_prime", 3), "N m"),
        Row("robot: moment of inertia I_rob", "6.147", f"{plan['i_rob']:.3f}", "kg m²"),
        Row("robot: height of the CoM b_r", "0.71", f"{plan['b_r']:.3f}", "m"),
        Row("robot: B above the CoM a_r", "-", f"{plan['a_r']:.3f}", "m"),
        Row("hinge to B l_B", "0.42", f"{plan['l_b']:.3f}", "m"),
        Row("effective mass m_re by eq. (3)", "47.92",
            f"{plan['effective_mass_planar']:.1f}", "kg"),
        Row("effective mass planned with", "-", f"{plan['effective_mass']:.1f}", "kg"),
        Row("door after the hit w', planned", "-", f"{plan['omega_door']:.3f}", "rad/s"),
        Row("door after the hit w', measured", "-", f"{hit['omega_door_measured']:.3f}", "rad/s"),
        Row("B before the hit v_rB, planned", "-", f"{plan['v_rb']:.3f}", "m/s"),
        Row("B before the hit v_rB, measured", "-", f"{hit['v_rb_measured']:.3f}", "m/s"),
        Row(f"{joint} carried in the hit", "-", f"{carried:.2f} (motor: at most {motor:.2f})",
            "N m s"),
        Row("legs slow down after the contact's begin", "-", "-" if late is None else f"{late:.1f}",
            "ms"),
        Row("contacts before the peak", "1", f"{hit['contacts_before_peak']}", ""),
        Row("desired opening angle", "25" if nominal else "-", target, "deg"),
        Row("largest opening angle", "26.3 (simulation)" if nominal else "-",
            f"{door['peak_deg']:.2f}", "deg"),
        Row("error of it", "<= 2 (experiment)", f"{door['error_deg']:+.2f}", "deg"),
        Row("fell back, until the hand stopped it, to", "-",
            f"{caught_deg:.1f}" if held else "-", "deg"),
        Row("pushed back and held at", "25" if nominal else "-",
            f"{door['held_deg']:.2f}" if held else "-", "deg"),
        Row("ZMP (mean of 20 ms) in the support polygon", "inside",
            "inside" if margin > 1.0 else "on the edge" if margin > -1.0 else "outside", ""),
        Row(f"smallest margin of it, in {phase}", "-", f"{margin:.1f}", "mm"),
        Row("foot slip", "avoided", f"{robot['foot_slip_mm']:.2f}", "mm"),
        Row("robot", "stands", "fell" if robot["fell"] else "stands", ""),
    ]
    return lines


def text(lines: Sequence[Row]) -> str:
    """The table for a terminal."""
    header = Row("", "paper", "measured", "")
    widths = [max(len(getattr(row, key)) for row in (header, *lines))
              for key in ("name", "paper", "measured")]
    rule = "-" * (sum(widths) + 4 + 12)

    def line(row: Row) -> str:
        return (f"{row.name:<{widths[0]}}  {row.paper:>{widths[1]}}  "
                f"{row.measured:>{widths[2]}}  {row.unit}").rstrip()

    return "\n".join([rule, line(header), rule, *(line(row) for row in lines), rule,
                      "-: the paper gives no figure; its 47.92 kg follow by eqs. (3) and (5)"])

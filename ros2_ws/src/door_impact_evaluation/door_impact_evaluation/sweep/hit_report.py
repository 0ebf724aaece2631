"""Reports the results of the hits: table, worst runs and figure."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from door_impact_common.palette import BLUE, GREEN, ORANGE

from door_impact_evaluation.sweep.hit_runs import by_error
from door_impact_evaluation.sweep.kind import replay_lines
from door_impact_evaluation.sweep.numbers import is_known, known, shown

WORST = 5  # runs with the largest errors that the table lists
_PERTURBED = {"color": BLUE, "mark": "o", "line": "-"}
_ROUGH = {"color": ORANGE, "mark": "x", "line": "--"}
_LEARNED = {"color": GREEN, "mark": "^", "line": "-."}
AFTER = ("post", "hold", "retreat")  # phases after the hit
_CAUSES = (
    ("door farther than surveyed [mm]", lambda case: 1e3 * case["door_offset"]),
    ("factor of the closer's torque tau'_c0", lambda case: case["closer"][2]),
    ("coefficient of restitution", lambda case: case["restitution"]),
    ("factor of the rotors' inertia", lambda case: case["rotor_scale"]),
    ("friction of the soles", lambda case: case["friction"]),
    ("factor of the gears' stiffness", lambda case: case["gear_scale"]),
    ("factor of the pads' stiffness", lambda case: case["pad_scale"]),
)
"""Name and value of each perturbation against which the figure shows the errors."""


def table(found: dict[str, Any]) -> str:
    """Formats the results as a table for a terminal.

    Args:
        found: Contents of summary.json.
    """
    lines = [f"{'nominal doors, known exactly':34}{'1st hit':>9}  {'2nd hit':>9}  "
             f"{'margin before':>14}, after{'v_rB':>11}  {'momentum':>7}",
             "  (errors of the largest angle [deg]; smallest ZMP margin before and after the hit; "
             "v_rB and momentum, measured against planned)"]
    by_name: dict[str, list[dict[str, Any]]] = {}
    for record in found["nominal"]:
        by_name.setdefault(record["name"], []).append(record)
    lines += [_nominal(records) for records in by_name.values()]
    lines += ["", f"{found['n']} perturbed doors, seed {found['seed']}, engine "
              f"{found['engine']}, for 25 deg"
              "     mean      sd    95 %*    max*", "  (* of the magnitudes of the errors)"]
    for label, key in (("perturbed, first hit", "error_deg"),
                       ("rough, first hit", "before_learning"),
                       ("rough, after a hit", "after_learning")):
        row = found[key]
        lines.append(f"  {label:40}" + "".join(
            f"{row[name]:{sign}8.2f}" if row[name] is not None else f"{'-':>8}"
            for name, sign in (("mean", "+"), ("sd", ""), ("p95", ""), ("max", ""))) + "  deg")
    every = [record["stood"] for record in found["runs"] if "stood" in record]
    lines += [f"  the robot stood after {sum(every)} of all {len(every)} hits",
              f"  perturbed, first hit: stood {found['stood']} of {found['n']}, "
              "one contact before the peak "
              f"{found['contacts_one']} of {found['n']}, refused {found['refused']} of all plans",
              "  smallest ZMP margin, all runs [mm]: " + ", ".join(
                  f"{name} {shown(row['min'])} (5 % below {shown(row['p5'])})"
                  for name, row in found["min_margin_mm"].items()),
              "", "worst runs"]
    hits = [r for r in found["runs"] if "error_deg" in r and r["case"]["group"] != "nominal"]
    worst = sorted(hits, key=by_error)[:WORST]
    worst += [r for r in found["runs"] if r not in worst
              and ("refused" in r or not r.get("stood", True))]
    lines += [_worst(record) for record in worst]
    return "\n".join([*lines, *replay_lines(found)])


def _nominal(records: list[dict[str, Any]]) -> str:
    case = records[0]["case"]
    label = f"  {case['door']}, {case['target_deg']:g} deg, {case['run_up']}"
    if "error_deg" not in records[0]:
        return f"{label:34}{records[0].get('refused') or records[0]['outcome']}"
    # The plan of the second hit may have been refused.
    records = [record for record in records if "error_deg" in record]
    angles = "".join(f"{shown(record['error_deg'], '+.2f'):>9}  " for record in records)
    margins = [record["margin_mm"] for record in records]
    before, after = (
        min(known(value for each in margins for name, value in each.items()
                  if (name in AFTER) == later), default=None) for later in (False, True))
    first = records[0]
    return (f"{label:34}{angles}{shown(before):>14}, {shown(after)} mm"
            f"{100.0 * (first['v_rb'] / first['planned']['v_rb'] - 1.0):+14.1f} %"
            f"{100.0 * (first['momentum_ratio'] - 1.0):+7.1f} %")


def _worst(record: dict[str, Any]) -> str:
    case = record["case"]
    what = (f"refused: {record['refused']}" if "refused" in record else
            f"{shown(record['error_deg'], '+.2f')} deg" if "error_deg" in record else
            record["outcome"])
    restitution = "as configured" if case["restitution"] is None else f"{case['restitution']:.3f}"
    stood = "" if record.get("stood", True) else ", did not stand"
    return (f"  {record['name']} hit {record['hit'] + 1}: {what}{stood}; door "
            f"{1e3 * case['door_offset']:+.0f} mm, e {restitution}, rotors "
            f"{case['rotor_scale']:.2f}, friction {case['friction']:.2f}")


def figure(found: dict[str, Any], path: Path) -> None:
    """Draws the distributions of errors, margins and latencies, and errors over perturbations.

    Args:
        found: Contents of summary.json.
        path: Picture to write.
    """
    runs = [r for r in found["runs"]
            if is_known(r.get("error_deg")) and r["case"]["group"] != "nominal"]
    series = [(label, style, [r for r in runs if (r["case"]["group"], r["hit"]) == key])
              for label, style, key in (
                  ("perturbed, first hit", _PERTURBED, ("perturbed", 0)),
                  ("rough, first hit", _ROUGH, ("rough", 0)),
                  ("rough, after a hit", _LEARNED, ("rough", 1)))]
    drawing, axes = plt.subplots(4, 3, figsize=(9.6, 11.0), layout="constrained")
    spread = axes[0, 0]
    errors = [[r["error_deg"] for r in rows] for _, _, rows in series]
    every = [value for each in errors for value in each] or [0.0]
    bins = np.linspace(min(*every, -1.0) - 0.1, max(*every, 1.0) + 0.1, 25).tolist()
    for (label, style, _), values in zip(series, errors, strict=True):
        spread.hist(values, bins, histtype="step", color=style["color"], label=label,
                    linewidth=1.5, linestyle=style["line"])
    spread.set(xlabel="error: largest less desired angle [deg]", ylabel="runs")
    spread.set_ylim(top=1.35 * spread.get_ylim()[1])  # room for the legend
    spread.legend(fontsize=8)
    for axis, (name, value) in zip(axes.flat[1:8], _CAUSES, strict=True):
        for _, style, rows in series:
            axis.plot([value(r["case"]) for r in rows], [r["error_deg"] for r in rows],
                      style["mark"], color=style["color"], markersize=4.0)
        axis.axhline(0.0, color="0.7", linewidth=0.8)
        axis.set(xlabel=name, ylabel="error [deg]")
    margins = axes.flat[8]
    names = list(found["min_margin_mm"])
    every_margin = [known(r["margin_mm"].get(name) for r in runs) for name in names]
    margins.boxplot([each if len(each) else [np.nan] for each in every_margin], whis=(0.0, 100.0))
    margins.set_xticks(range(1, len(names) + 1), names, rotation=45)
    margins.set(ylabel="smallest ZMP margin of a run [mm]")
    late = axes.flat[9]
    late.hist(known(r["switch_latency_ms"] for r in runs), 20, color=BLUE)
    late.set(xlabel="time from contact to switch [ms]", ylabel="runs")
    for unused in axes.flat[10:]:
        unused.set_axis_off()
    drawing.savefig(path, dpi=110)
    plt.close(drawing)

"""Drawing of a plan: the run-up's cam curve, CoM and ZMP, and the margins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .plan_types import ImpactPlan


def draw_plan(plan: ImpactPlan, path: Path) -> None:
    """Write a figure of a plan; the format follows from the file's suffix.

    Raises:
        ImportError: matplotlib is not installed.
        OSError, ValueError: The file cannot be written.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("matplotlib is missing: pip install matplotlib") from error
    figure = Figure(figsize=(9.0, 9.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(3, 1)
    _draw_run_up(axes[0], plan)
    _draw_zmp(axes[1], plan)
    _draw_margins(axes[2], plan)
    figure.savefig(path)


def _draw_run_up(axis: Any, plan: ImpactPlan) -> None:
    cam = plan.phase("cam")
    y = cam.com_samples[:, 1]
    speed = -np.gradient(y, cam.time)
    axis.plot(cam.time, -(y - y[0]), label="way of the CoM [m]")
    axis.plot(cam.time, speed, label="speed of the CoM [m/s]")
    axis.plot(cam.time, np.gradient(speed, cam.time) / 10.0, label="acceleration / 10 [m/s²]")
    axis.axvline(plan.contact_time, color="brown", linestyle="--", label="nominal contact")
    course = "first half of MCV50" if plan.run_up == "mcv50" else "largest ZMP margin"
    axis.set_title(f"Run-up: {course}, then constant speed")
    axis.set_xlabel("time in the phase cam [s]")
    axis.legend()


def _draw_zmp(axis: Any, plan: ImpactPlan) -> None:
    offset = 0.0
    for number, phase in enumerate(plan.phases):
        # The run-up is planned beyond the switch to `post`, as a reserve.
        shown = phase.time <= (plan.switch_time if phase.name == "cam" else np.inf)
        time = offset + phase.time[shown]
        com, zmp = phase.com_samples[shown, 1], phase.zmp_samples[shown, 1]
        axis.plot(time, -com, "C0", label="CoM" if not number else None)
        axis.plot(time, -zmp, "C1", label="ZMP" if not number else None)
        axis.axvline(offset, color="0.8", linewidth=0.8)
        axis.text(offset, 1.01, phase.name, transform=axis.get_xaxis_transform(), fontsize=8)
        offset += plan.switch_time if phase.name == "cam" else float(phase.time[-1])
    for name, foot, color in (("left", plan.left_foot, "C2"), ("right", plan.right_foot, "C3")):
        axis.axhline(-foot[1], color=color, linestyle=":", linewidth=0.9, label=f"{name} ankle")
    axis.set_xlabel("time [s]")
    axis.set_ylabel("-y [m], towards the door")
    axis.legend()


def _draw_margins(axis: Any, plan: ImpactPlan) -> None:
    margins = plan.zmp_margins
    axis.bar(list(margins), [1e3 * margin for margin in margins.values()])
    axis.set_ylabel("smallest ZMP margin [mm]")
    axis.set_title(
        f"door {plan.door!r}, planned: w' {plan.omega_door:.3f} rad/s, v_rB {plan.v_rb:.3f} m/s, "
        f"m_re {plan.effective_mass:.1f} kg"
    )

"""Draw the paper's figures from what a demonstration measured."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")  # no display is assumed

import matplotlib.pyplot as plt
import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.palette import BLUE, GREEN, LIGHT_GREY, ORANGE, PURPLE, VERMILION
from door_impact_common.span_labels import label_spans
from door_model.door.closer import FourBarCloser
from door_model.door.door import Door
from impact_planner.motion.cam_curve import mcv50
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from door_impact_evaluation.run.record import DemoRecord

_DOOR = r"angle of the door $\theta$ [deg]"


def _axes(title: str, xlabel: str, ylabel: str) -> tuple[Figure, Axes]:
    figure, axes = plt.subplots(figsize=(7.2, 4.2), layout="constrained")
    axes.set(title=title, xlabel=xlabel, ylabel=ylabel)
    axes.grid(alpha=0.3)
    return figure, axes


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _shown_angles(closer: FourBarCloser) -> Array:
    """Return opening angles from 0 to 90 deg, or to 1 deg before the linkage's end [rad]."""
    return np.linspace(0.0, min(0.5 * np.pi, closer.opening_limit() - np.radians(1.0)), 200)


def closer_angle(closer: FourBarCloser, path: Path) -> None:
    """Draw the closer's angle over the door's angle, eq. (8); the paper's Fig. 15.

    Args:
        closer: The closer's linkage.
        path: Picture to write.
    """
    figure, axes = _axes("Angle of the closer (the paper's Fig. 15)", _DOOR,
                         r"angle of the closer $\theta_c = f(\theta)$ [deg]")
    theta = _shown_angles(closer)
    axes.plot(np.degrees(theta), np.degrees(closer.f(theta)), color=BLUE, lw=2)
    _save(figure, path)


def restoring_torque(identified: Door, true: Door, swung_to: float, path: Path) -> None:
    """Draw the restoring torque of the identified and the simulated door; the paper's Fig. 16.

    Args:
        identified: Door with the identified parameters.
        true: Door that the simulation moves.
        swung_to: Largest angle of the swings that the parameters were identified from [rad].
        path: Picture to write.
    """
    figure, axes = _axes(
        "Restoring torque (the paper's Fig. 16)", _DOOR,
        "restoring torque [N m]\n" r"$\tau_1 = \eta(\theta)\,\{k_c\, f(\theta) + \tau'_{c0}\}$")
    axes.axvspan(0, np.degrees(swung_to), color=LIGHT_GREY, alpha=0.6,
                 label="range of the pushes by hand")
    for door, style in (
            (true, {"color": "k", "lw": 2.5, "alpha": 0.35, "label": "simulated door"}),
            (identified, {"color": PURPLE, "ls": "--", "label": "identified"})):
        theta = _shown_angles(door.closer)
        axes.plot(np.degrees(theta), door.restoring_torque(theta), **style)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.legend()
    _save(figure, path)


def identification_fit(swings: Sequence[tuple[Array, Array, Array]], rmse_deg: float, path: Path,
                       ) -> None:
    """Draw measured swings and eq. (1) with the identified parameters; the paper's Fig. 11.

    Args:
        swings: Of the opening part of each swing, sample times (n,) [s], and opening angles as they
            were measured and by eq. (1), (n,) each [rad].
        rmse_deg: Root mean square of the identification's residuals [deg].
        path: Picture to write.
    """
    figure, axes = _axes(
        f"Identification from {len(swings)} pushes by hand (the paper's Fig. 11), "
        f"rms error {rmse_deg:.3f} deg", "time from the start of the free swing [s]", _DOOR)
    for index, (t, measured, fitted) in enumerate(swings):
        axes.plot(t - t[0], np.degrees(measured), color="k", lw=2.5, alpha=0.35,
                  label="encoder" if index == 0 else None)
        axes.plot(t - t[0], np.degrees(fitted), color=VERMILION, ls="--", lw=1.2,
                  label="eq. (1) with the identified parameters" if index == 0 else None)
    axes.legend()
    _save(figure, path)


def cam(path: Path) -> None:
    """Draw the normalised modified constant velocity cam curve MCV50; the paper's Fig. 6."""
    T = np.linspace(0.0, 1.0, 801)
    figure, panels = plt.subplots(3, 1, figsize=(7.2, 5.6), sharex=True, layout="constrained")
    curve = mcv50(T)
    curves = (("displacement S", curve.s), ("velocity V", curve.v), ("acceleration A", curve.a))
    for axes, (name, values) in zip(panels, curves, strict=True):
        axes.plot(T, values, color=BLUE)
        axes.axvspan(0.0, 0.5, color=LIGHT_GREY, alpha=0.6,
                     label="first half: used as the run-up mcv50")
        axes.set_ylabel(name)
        axes.grid(alpha=0.3)
    panels[0].legend()
    panels[0].set_title("Modified constant velocity cam curve MCV50 (the paper's Fig. 6)")
    panels[-1].set_xlabel("normalised time T; the hit is at T = 0.5")
    _save(figure, path)


def zmp(record: DemoRecord, path: Path) -> None:
    """Draw the ZMP in the support polygon over time; the door is upwards; the paper's Fig. 8.

    Args:
        record: What was measured of the motion.
        path: Picture to write.
    """
    figure, axes = plt.subplots(figsize=(9.0, 4.6), layout="constrained")
    t0, motion, support = record.phases["prepare"][0], record.motion, record.support
    t = motion.t - t0
    axes.fill_between(t, support.low, support.high, color=LIGHT_GREY, step="mid",
                      label="support polygon")
    axes.plot(t, -motion.left_sole[:, 1], color=BLUE, ls="--", lw=1, label="left ankle")
    axes.plot(t, -motion.right_sole[:, 1], color=GREEN, ls="-.", lw=1, label="right ankle")
    # The topic lies under the mean of the simulation's own wrenches: wide, so that it is seen.
    axes.plot(record.zmp_topic[:, 0] - t0, -record.zmp_topic[:, 2], color=ORANGE, lw=3.0,
              label="/zmp, every message")
    axes.plot(t, -support.zmp[:, 1], color="k", lw=0.9,
              label="ZMP from the simulation's log, 20 ms mean")
    axes.axvline(record.contact_time - t0, color=PURPLE, ls="--", label="impact")
    for start, _ in record.phases.values():
        axes.axvline(start - t0, color="k", lw=0.4, alpha=0.4)
    axes.set(xlabel="time from the start of the motion [s]",
             ylabel="towards the door, -y in odom [m]",
             xlim=(0.0, record.phases[list(record.phases)[-1]][1] - t0))
    shown = t >= 0.0  # not a walk up to the door
    axes.set_ylim(support.low[shown].min() - 0.05, support.high[shown].max() + 0.05)
    figure.legend(fontsize=8, ncols=3, loc="outside lower center")
    axes.grid(alpha=0.3)
    pad = label_spans(
        axes, [(name, start - t0, end - t0) for name, (start, end) in record.phases.items()
               if start >= t0])
    axes.set_title("ZMP from the foot sensors (the paper's Fig. 8)", pad=pad)
    _save(figure, path)


def door_angle(record: DemoRecord, target_deg: float, path: Path) -> None:
    """Draw the door's angle after the impact and the desired angle; the paper's Fig. 9.

    Args:
        record: What was measured of the motion.
        target_deg: Desired opening angle [deg].
        path: Picture to write.
    """
    figure, axes = _axes("Door after the impact (the paper's Fig. 9)",
                         "time from the impact [s]", _DOOR)
    t, angle = record.door_topic[record.door_topic[:, 0] >= record.contact_time - 0.2].T
    axes.plot(t - record.contact_time, np.degrees(angle), color=BLUE, label="/door_angle")
    axes.axhline(target_deg, color=VERMILION, ls=":", label=f"desired angle, {target_deg:g} deg")
    axes.axvline(0.0, color=PURPLE, ls="--", label="impact")
    axes.legend(loc="lower right")
    _save(figure, path)

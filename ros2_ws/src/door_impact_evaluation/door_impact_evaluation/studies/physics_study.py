"""Measure what the simulated hit depends on: the figures of docs/physics.md."""

import argparse
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from door_impact_common.files import make_folder, run_command, write_whole
from door_model.door.config import load_door
from door_model.door.surface import reduced_mass
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.benches.drop_bench import drop_test
from hrp2_sim_bridge.benches.pull_bench import pull_test
from hrp2_sim_bridge.physics.contact import design_contact
from hrp2_sim_bridge.settings import ENGINES, WorldSettings
from humanoid_motion.robot_model import RobotModel
from impact_planner.impact_plan import ImpactPlan
from tqdm import tqdm

from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse

mpl.use("Agg")  # no display is assumed

import matplotlib.pyplot as plt
from door_impact_common.palette import BLUE, GREEN, VERMILION
from matplotlib.figure import Figure

MARKS = ("o-", "x--")  # line styles of the engines
_SIZE = (7.2, 3.6)  # width and height of a picture [inch]

_UNKNOWNS = (
    ("gear_scale", 1.0, "gears' stiffness [times the model's]"),
    ("pad_scale", 1.0, "pads' stiffness [times the model's]"),
    ("servo_scale", 1.0, "servos' gains [times the model's]"),
    ("rotor_scale", 1.0, "rotors' inertia [times the model's]"),
    ("restitution", 1.0, "restitution of the leaf"),
    ("contact_duration", 1e3, "duration of the contact [ms]"),
    ("leaf_friction", 1.0, "friction of the leaf"),
    ("friction", 1.0, "friction of the soles"),
    ("door_offset", 1e3, "door farther than surveyed [mm]"),
)


def draw(summary: Mapping[str, Any], out: Path) -> None:
    """Draw a picture of each part of the study that was run.

    Args:
        summary: Contents of summary.json, as `physics_study.study` returns them.
        out: Folder of the pictures.
    """
    sweeps = summary["sweeps"]
    if {"fine_step", "both_steps"} <= sweeps.keys():
        _time_steps(summary, out / "time_step.png")
    if {name for name, _, _ in _UNKNOWNS} <= sweeps.keys():
        _unknowns(summary, out / "unknowns.png")


def _column(rows: Sequence[Mapping[str, Any]], key: str) -> list[float]:
    return [row.get(key, float("nan")) for row in rows]


def _time_steps(summary: Mapping[str, Any], path: Path) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=_SIZE, layout="constrained")
    for name, label, color in (("fine_step", "near the leaf, 0.5 ms elsewhere", BLUE),
                               ("both_steps", "everywhere", VERMILION)):
        for (engine, rows), mark in zip(summary["sweeps"][name].items(), MARKS, strict=False):
            step = [1e3 * value for value in _column(rows, "time_step_fine")]
            left.semilogx(step, _column(rows, "peak_deg"), mark, color=color,
                          label=f"{label}, {engine}")
            error = [1e2 * value for value in _column(rows, "speed_error_before_hit")]
            right.semilogx(step, error, mark, color=color)
    left.set(title="largest opening angle", xlabel="step [ms]", ylabel="angle [deg]")
    right.set(title="speed of B before the hit", xlabel="step [ms]",
              ylabel="largest error of the speed [%]")
    left.legend(fontsize=7)
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    for axes in figure.axes:
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _unknowns(summary: Mapping[str, Any], path: Path) -> None:
    """Draw the largest opening angle over each setting, all on one scale of angles."""
    figure, grid = plt.subplots(3, 3, figsize=(9.0, 8.0), layout="constrained", sharey=True)
    for axes, (name, scale, label) in zip(grid.flat, _UNKNOWNS, strict=True):
        axes.axhline(summary["target_deg"], color=GREEN, ls=":", label="desired")
        for (engine, rows), mark, color in zip(
                summary["sweeps"][name].items(), MARKS, (BLUE, VERMILION), strict=False):
            axes.plot([scale * value for value in _column(rows, name)],
                      _column(rows, "peak_deg"), mark, color=color, label=engine)
        axes.set(xlabel=label)
    for axes in grid[:, 0]:
        axes.set(ylabel="largest opening angle [deg]")
    grid[0, 0].legend()
    _save(figure, path)


TARGET_DEG = 25.0  # desired opening angle of every hit [deg]
BALL = 47.0   # mass of the ball in the drop tests [kg]
LEVER = 0.42  # distance from the hinge at which the ball hits [m]
RESTITUTIONS = (0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # requested in the drop tests
SPEEDS = (0.2, 0.5, 0.9)  # speeds of the ball in the drop tests [m/s]
SCALES = (0.5, 0.7, 1.0, 1.4, 2.0)  # factors of rotors, gears, servos and pads
SWEEPS: dict[str, tuple[tuple[str, tuple[Any, ...]], ...]] = {
    "fine_step": (("time_step_fine", (1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)),),
    "both_steps": (("time_step_coarse", (1e-3, 5e-4, 2.5e-4, 1.25e-4)),
                   ("time_step_fine", (1e-3, 5e-4, 2.5e-4, 1.25e-4))),
    "contact_duration": (("contact_duration", (0.005, 0.0075, 0.010, 0.015, 0.020, 0.030)),),
    "restitution": (("restitution", (0.4, 0.45, 0.5, 0.55, 0.6)),),
    "rotor_scale": (("rotor_scale", SCALES),),
    "gear_scale": (("gear_scale", SCALES),),
    "servo_scale": (("servo_scale", SCALES),),
    "pad_scale": (("pad_scale", SCALES),),
    "door_offset": (("door_offset", (-0.02, -0.01, -0.001, 0.0, 0.001, 0.01, 0.02)),),
    "friction": (("friction", (0.4, 0.5, 0.6, 0.8, 1.0)),),
    "iterations": (("iterations", (20, 50, 100, 200)),),
    "brace": (("brace", ("contact", "rigid", "none")),),
    "leaf_friction": (("leaf_friction", (0.0, 0.15, 0.3, 0.45, 0.6)),),
    "sole": (("sole", ("rubber", "rigid", "rubber")), ("stabilizer", (True, True, False))),
}
"""Settings of the simulated world that each sweep changes, with their values run by run."""

_PYBULLET_ONLY = ("iterations",)  # sweeps of what only PyBullet has


def effective_masses(robot: RobotModel, plan: ImpactPlan) -> dict[str, Any]:
    """Compute the effective mass at point B by eq. (3), spatially and by the pull test [kg].

    Args:
        robot: The robot.
        plan: Plan whose posture at the contact is taken.
    """
    config = robot.config
    joints = plan.phase("cam").knots.at(plan.contact_time)[0][0]
    q = robot.configuration(np.array([0.0, 0.0, plan.waist_height]), joints)
    rows = []
    for braced in (True, False):
        locked = config.braced_joints if braced else ()
        rows.append({
            "braced": braced,
            "spatial": robot.effective_mass(q, locked=locked),
            **{engine: pull_test(config, joints, locked=locked, engine=engine)
               for engine in ENGINES},
        })
    return {"planar": plan.effective_mass_planar, "planned": plan.effective_mass, "rows": rows}


def figures_of(run: Rehearsal) -> dict[str, Any]:
    """Evaluate a run.

    Args:
        run: The run.

    Returns:
        Figures of the run; those of the hit only if the robot touched the door.
    """
    motion, hit, plan = run.log.motion, run.impact, run.plan
    support = evaluation.support(motion, run.robot, window=evaluation.WINDOW)
    inside = (motion.t > 0.1) & (motion.t < motion.t[-1] - 0.05)
    found: dict[str, Any] = {
        "fell": run.log.fell,
        "outcome": run.execution.outcome.name,
        "margin_mm": 1e3 * float(np.nanmin(support.margin[inside])),
        "max_torque_ratio": run.log.max_torque_ratio,
        "tilt_deg": float(np.degrees(evaluation.tilt(motion.base_orientation).max())),
    }
    if hit is None:
        return found
    loads = run.log.hit_loads(hit)
    before = motion.t[hit.contact.start]
    near = (motion.t > before - 0.06) & (motion.t < before - 0.005)
    # From 60 to 5 ms before the hit the planned speed of B is constant.
    drift = motion.point_b_velocity[near] / plan.v_rb - 1.0
    lost = hit.v_rb - hit.v_rb_post
    return found | {
        "peak_deg": float(np.degrees(motion.door_angle[hit.peak])),
        "v_rb": hit.v_rb,
        "v_rb_post": hit.v_rb_post,
        "omega_door": hit.omega_door,
        "restitution_shown": hit.restitution,
        "duration_ms": 1e3 * hit.duration,
        "peak_force": hit.peak_force,
        "effective_mass": run.log.i_a * hit.omega_door / (plan.l_b * lost),
        "speed_error_before_hit": float(np.abs(drift).max()),
        "gear_load": loads.shares,
        "gear_torque": loads.gears,
        "pad_force": loads.pad_force,
    }


def drop_tests(engine: str) -> list[dict[str, float]]:
    """Measure the restitution of the leaf's surface in an engine for each requested one."""
    door, step = load_door("paper"), WorldSettings.time_step_fine
    rows = []
    for wanted in RESTITUTIONS:
        design = design_contact(
            wanted, reduced_mass(BALL, door.i_a / LEVER**2), WorldSettings.contact_duration, step)
        for speed in SPEEDS:
            shown = drop_test(
                door, design, mass=BALL, lever=LEVER, speed=speed, step=step, engine=engine)
            rows.append({"wanted": wanted, "speed": speed, "shown": shown.restitution,
                         "momentum_ratio": shown.momentum_ratio})
    return rows


def study(out: Path, names: Iterable[str], robot: RobotModel) -> str:
    """Run the sweeps, write ``summary.json`` and the pictures, and say where they are.

    Args:
        out: Folder of the results.
        names: Names of the sweeps to run, keys of `SWEEPS`.
        robot: The robot.
    """
    make_folder(out)
    log = out / "run.npz"
    runs = {engine: rehearse(TARGET_DEG, log, engine=engine, robot=robot) for engine in ENGINES}
    nominal = runs[WorldSettings.engine]
    summary: dict[str, Any] = {
        "target_deg": TARGET_DEG,
        "nominal": {engine: figures_of(run) for engine, run in runs.items()},
        "plan": {"v_rb": nominal.plan.v_rb, "omega_door": nominal.plan.omega_door,
                 "v_rb_post": nominal.plan.v_rb_post},
        "effective_mass": effective_masses(robot, nominal.plan),
        "drop_test": {engine: drop_tests(engine) for engine in ENGINES},
        "sweeps": {},
    }
    for name in tqdm(list(names), desc="sweeps"):
        keys, columns = zip(*SWEEPS[name], strict=True)
        rows = [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]
        summary["sweeps"][name] = {
            engine: [row | figures_of(rehearse(TARGET_DEG, log, engine=engine, robot=robot, **row))
                     for row in tqdm(rows, desc=f"{name}, {engine}", leave=False)]
            for engine in ENGINES if engine != "mujoco" or name not in _PYBULLET_ONLY
        }
        write_whole(out / "summary.json", json.dumps(summary, indent=1) + "\n")
    draw(summary, out)
    return f"written to {out}"


def main(args: list[str] | None = None) -> int:
    """Run the study.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        0, or 1 if the folder cannot be written.
    """
    parser = argparse.ArgumentParser(
        prog="physics_study",
        description="Measures what the simulated hit depends on, in both physics engines "
                    "(docs/physics.md); all sweeps take about fifteen minutes.")
    parser.add_argument("sweeps", nargs="*", metavar="SWEEP",
                        help=f"sweeps: {', '.join(SWEEPS)} (default: all)")
    parser.add_argument("--out", type=Path, default=Path("out/physics"),
                        help="folder of the results (default: out/physics)")
    parser.add_argument("--robot", help="robot.yaml of another robot (default: HRP-2)")
    options = parser.parse_args(args)
    unknown = [name for name in options.sweeps if name not in SWEEPS]
    if unknown:
        parser.error(f"there is no sweep {unknown[0]}; there are {', '.join(SWEEPS)}")
    return run_command("physics_study", lambda: study(
        options.out, options.sweeps or SWEEPS, RobotModel(load_robot_config(options.robot))))


if __name__ == "__main__":
    sys.exit(main())

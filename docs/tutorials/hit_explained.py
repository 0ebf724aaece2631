"""Draw the pictures of hit_explained.md: a simulated hit in time, and the door after hits.

Run it with `.venv/bin/python docs/tutorials/hit_explained.py`; it takes half a minute.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from door_impact_common.palette import BLUE, LINES, VERMILION
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from door_model.door.config import load_door
from door_model.motion.dynamics import follow_free, initial_velocity
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

ANGLE = 25.0  # desired opening angle [deg]
SHOWN = (-10.0, 60.0)  # time around the first contact that is drawn [ms]
ANGLES = (10.0, 20.0, 25.0, 30.0)  # peaks of the free swings that are drawn [deg]
STYLES = tuple(zip(LINES, ("-", "--", "-.", ":"), strict=False))


def main(args: list[str] | None = None) -> None:
    """Simulate a hit and draw the pictures."""
    parser = argparse.ArgumentParser(description="Draw the pictures of the hit explained.")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(""))
    out = parser.parse_args(args).out
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        run = rehearse(ANGLE, Path(folder) / "hit.npz")
    draw_hit(run, out / "in_time.png")
    draw_swings(out / "swings.png")


def draw_hit(run: Rehearsal, path: Path) -> None:
    """Force, speeds and opening during the contact, over the time from the first contact."""
    if run.impact is None:
        raise SystemExit("The robot did not touch the door.")
    motion, l_b = run.log.motion, run.plan.l_b
    time = 1e3 * (motion.t - motion.t[run.impact.contact.start])
    rows = (time >= SHOWN[0]) & (time <= SHOWN[1])
    time = time[rows]
    figure = Figure(figsize=(7.2, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    force, speed, angle = figure.subplots(3, 1, sharex=True)
    force.plot(time, motion.contact_force[rows], color=BLUE)
    force.set_ylabel("force on the leaf [N]")
    speed.plot(time, motion.point_b_velocity[rows], color=BLUE, label="elbow, B")
    speed.plot(time, motion.door_velocity[rows] * l_b, color=VERMILION, linestyle="--",
               label="leaf at B")
    speed.set_ylabel("speed [m/s]")
    speed.legend(loc="upper right")
    angle.plot(time, np.degrees(motion.door_angle[rows]), color=VERMILION, linestyle="--")
    angle.set(ylabel="opening angle [deg]", xlabel="time after the first contact [ms]")
    for axes in (force, speed, angle):
        axes.axvspan(0.0, 1e3 * run.impact.duration, color="0.9")
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def draw_swings(path: Path) -> None:
    """The paper's door after hits of different speeds: angle over time, torque over angle."""
    door = load_door("paper").door()
    peaks = np.radians(ANGLES)
    omega = initial_velocity(door, peaks)
    time = np.linspace(0.0, 4.0, 400)
    theta, _ = follow_free([door] * len(peaks), 0.0, omega).at(time)
    figure = Figure(figsize=(7.2, 5.6), layout="constrained")
    FigureCanvasAgg(figure)
    swing, torque = figure.subplots(2, 1)
    for course, start, (color, style) in zip(theta.T, omega, STYLES, strict=True):
        swing.plot(time, np.degrees(course), color=color, linestyle=style,
                   label=f"w' = {start:.2f} rad/s")
    swing.set(xlabel="time after the hit [s]", ylabel="opening angle [deg]")
    swing.legend()
    angle = np.linspace(0.0, np.radians(90.0), 200)
    torque.plot(np.degrees(angle), door.restoring_torque(angle), color=BLUE)
    torque.set(xlabel="opening angle [deg]", ylabel="restoring torque [N m]")
    torque.set_ylim(bottom=0.0)
    for axes in (swing, torque):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()

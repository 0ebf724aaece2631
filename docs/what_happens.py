"""Draw the pictures of what_happens.md: hits in the simulation that differ in one thing.

Run it with `.venv/bin/python docs/what_happens.py`; it takes five minutes, and prints the figures
of the page: the simulated hits, and in brackets what eqs. (1) to (3) say of rigid bodies.
"""

import argparse
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.palette import BLUE, GREY
from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.rehearsal import execute
from door_model.door.config import load_door
from door_model.door.surface import mass_of_hit
from door_model.motion.dynamics import peak
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.physics.contact import design_leaf
from hrp2_sim_bridge.settings import WorldSettings
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.momentum import omega_for
from impact_planner.hit.placement import configured_settings
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from matplotlib.figure import Figure

ANGLE = 25.0  # planned opening angle where it is not what differs [deg]
ANGLES = (10.0, 15.0, 20.0, 25.0, 30.0)  # planned opening angles, for five v_rB [deg]
LEVERS = (0.25, 0.35, 0.45, 0.55, 0.65)  # l_B [m]
RESTITUTIONS = (0.3, 0.4, 0.5, 0.6, 0.7)
DURATIONS = (0.030, 0.020, 0.015, 0.010, 0.005)  # contact of free masses, soft to stiff [s]
LABELS = {
    "v_rb": "v_rB before the hit [m/s]", "l_b": "l_B [m]", "restitution": "restitution of the leaf",
    "stiffness": "stiffness of the contact [kN/m]", "omega": "w' of the door [rad/s]",
    "v_rb_post": "v'_rB after the hit [m/s]", "angle": "largest opening angle [deg]",
    "mass": "effective mass [kg]", "force": "largest force [kN]"}
STYLES = ((BLUE, "o-", "simulation"), (GREY, "--", "rigid bodies, eqs. (1) to (3)"))
DOOR = load_door("paper")
ROBOT = RobotModel(load_robot_config())


@dataclass(frozen=True)
class Hit:
    """A hit in the simulation, or of rigid bodies by eqs. (1) to (3) with restitution.

    Attributes:
        v_rb: Speed of B before the hit [m/s].
        l_b: Distance of B from the hinge [m].
        restitution: Coefficient of restitution of the leaf.
        stiffness: Stiffness of the leaf's surface [kN/m].
        omega: Angular velocity w' of the door after the hit [rad/s].
        v_rb_post: Speed of B after the hit [m/s].
        angle: Largest opening angle [deg].
        mass: Effective mass of the robot at B, eq. (2) [kg].
        force: Largest force on the leaf [kN]; NaN of rigid bodies.
    """

    v_rb: float
    l_b: float
    restitution: float
    stiffness: float
    omega: float
    v_rb_post: float
    angle: float
    mass: float
    force: float


def planned(angle_deg: float) -> ImpactPlan:
    """Plan a hit on the paper's door, after which the robot steps back."""
    request = PlanRequest(math.radians(angle_deg), ending="retreat")
    return plan_impact(
        request, KnownDoor.configured(DOOR), ROBOT, configured_settings(ROBOT))


def hit(plan: ImpactPlan, l_b: float | None = None, **settings: Any) -> tuple[Hit, Hit]:
    """Simulate a plan's hit with the hinge at l_b from B; return it, and that of rigid bodies."""
    l_b = l_b or plan.l_b
    place, world_settings = plan.hit.placement, WorldSettings(engine="mujoco", **settings)
    hinge_x = place.hinge_x + np.sign(place.hinge_x) * (l_b - plan.l_b)
    world = World(ROBOT.config, DOOR, place.door_distance, hinge_x, engine="mujoco", **settings)
    try:
        execute(world, ROBOT, plan)
        with tempfile.TemporaryDirectory() as folder:
            log = simulation_log.load(world.save_log(Path(folder) / "hit.npz"), 0.0)
    finally:
        world.close()
    if log.fell:
        raise SystemExit(f"The robot fell: {log.fell}; l_B = {l_b} m, {settings}.")
    found, e = evaluation.impact(log.motion, l_b), settings.get("restitution", DOOR.restitution)
    mass = DOOR.i_a * found.omega_door / (l_b * (found.v_rb - found.v_rb_post))
    simulated = Hit(
        found.v_rb, l_b, e, design_leaf(DOOR, hinge_x, world_settings).stiffness / 1e3,
        found.omega_door, found.v_rb_post, math.degrees(log.motion.door_angle[found.peak]), mass,
        found.peak_force / 1e3)
    omega = omega_for(found.v_rb, i_a=DOOR.i_a, l_b=l_b, restitution=e,
                      effective_mass=plan.effective_mass_planar)
    angle = math.degrees(float(peak(DOOR.door(), 0.0, omega).angle))
    return simulated, replace(
        simulated, omega=omega, v_rb_post=omega * l_b - e * found.v_rb, angle=angle,
        mass=plan.effective_mass_planar, force=math.nan)


def draw(path: Path, knob: str, right: str, hits: Sequence[tuple[Hit, Hit]]) -> None:
    """Draw the opening angle and one more quantity of hits over what differs, and print them."""
    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    for axes, name in zip(figure.subplots(1, 2), ("angle", right), strict=True):
        for column, (color, style, label) in zip(zip(*hits, strict=True), STYLES, strict=True):
            axes.plot([getattr(each, knob) for each in column],
                      [getattr(each, name) for each in column], style, color=color, label=label)
        axes.set(xlabel=LABELS[knob], ylabel=LABELS[name])
        axes.grid(alpha=0.3)
    figure.axes[0].legend(fontsize=8)
    figure.savefig(path, dpi=100, metadata={"Software": None})
    print(path.stem)
    for pair in hits:
        print(" ", *(f"{name} {getattr(pair[0], name):.3f} ({getattr(pair[1], name):.3f})"
                     for name in LABELS), flush=True)


def main(args: list[str] | None = None) -> None:
    """Simulate the hits and draw the pictures."""
    parser = argparse.ArgumentParser(description="Draw the pictures of what happens.")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(""))
    out = parser.parse_args(args).out
    out.mkdir(parents=True, exist_ok=True)
    plan = planned(ANGLE)
    draw(out / "v_rb.png", "v_rb", "omega", [hit(planned(angle)) for angle in ANGLES])
    usual = mass_of_hit(DOOR.i_a, plan.l_b)  # with one stiffness more mass takes longer
    draw(out / "l_b.png", "l_b", "v_rb_post", [
        hit(plan, l_b, contact_duration=WorldSettings.contact_duration * math.sqrt(
            mass_of_hit(DOOR.i_a, l_b) / usual)) for l_b in LEVERS])
    draw(out / "restitution.png", "restitution", "v_rb_post",
         [hit(plan, restitution=e) for e in RESTITUTIONS])
    draw(out / "stiffness.png", "stiffness", "force",
         [hit(plan, contact_duration=duration) for duration in DURATIONS])


if __name__ == "__main__":
    main()

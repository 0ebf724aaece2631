"""One hit in the simulation beside the planner's simulated hit, for the tests of the hit model."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal
from hrp2_description.robot import load_robot_config, needed
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.hit_response import HitResponse, HitSimulation, Switch
from impact_planner.hit.hit_structure import hit_structure
from impact_planner.hit.transfer import leaf_to_hit
from impact_planner.impact_plan import ImpactPlan
from impact_planner.task.known_door import KnownDoor

_FOLLOWED = 0.05  # time after the start of the contact in which the world is followed [s]
_SETTLED = 10  # samples after the contact over which v'_rB is a mean, as in the planner's model


@dataclass(frozen=True)
class Figures:
    """What a hit shows, in the simulation or by the planner's model."""

    omega: float  # angular velocity of the leaf at the end of the contact [rad/s]
    v_post: float  # mean speed of B in the 10 ms after the contact [m/s]
    mass: float  # effective mass [kg]
    restitution: float  # apparent restitution
    duration: float  # of the contact [s]
    peak: float  # largest force on the leaf, as a mean over a millisecond [N]
    pads: float  # largest normal force of the pads [N]
    gear: Array  # torques of the gears where they are largest in the contact, (30,) [N m]
    before: Array  # torques of the gears before the contact, (30,) [N m]
    preload: float  # normal force of the pads before it [N]


class HitLoads:
    """Torques of the gears and force of the pads, before the contact and in each step of it."""

    def __init__(self) -> None:
        self.rows: list[Array] = []
        self.before = np.empty(0)
        self._end = np.inf
        self._world: World | None = None

    def __call__(self, world: World, sample: TickSample) -> None:
        """Watch the world from the first tick on."""
        if self._world is None:
            self._world = world
            world.observers.append(self._add)

    def _add(self, engine: Any) -> None:
        world = self._world
        assert world is not None
        if world.time > self._end:
            return
        pads = world.joints.pads
        row = np.append(world.joints.drives.gear, 0.0 if pads is None else pads.force[0])
        if engine.touch().force > evaluation.CONTACT_FORCE:
            self._end = min(self._end, world.time + _FOLLOWED)
            self.rows.append(row)
        elif not self.rows:
            self.before = row


def pair_of(run: Rehearsal, loads: HitLoads, **scales: float) -> tuple[Figures, Figures]:
    """A simulated hit, and its prediction for the speed of B that it had.

    Args:
        run: The hit.
        loads: Its loads.
        scales: Settings of the world that scale its gears and pads.
    """
    plan, motion, hit = run.plan, run.log.motion, run.impact
    assert hit is not None
    start, end = hit.contact.start, hit.contact.end
    v_post = float(motion.point_b_velocity[end:end + _SETTLED + 1].mean())
    impulse = 1e-3 * float(motion.contact_force[start:end].sum())
    rows = np.array(loads.rows)
    gear = rows[:, :-1]
    simulated = Figures(
        omega=hit.omega_door, v_post=v_post, mass=impulse / (hit.v_rb - v_post),
        restitution=(hit.omega_door * plan.l_b - v_post) / hit.v_rb, duration=hit.duration,
        peak=hit.peak_force, pads=float(rows[:, -1].max()),
        gear=gear[np.abs(gear).argmax(axis=0), np.arange(gear.shape[1])],
        before=loads.before[:-1], preload=float(loads.before[-1]))
    return simulated, _predicted(plan, run.known, hit.v_rb, scales)


def _predicted(
    plan: ImpactPlan, known: KnownDoor, v_rb: float, scales: dict[str, float]
) -> Figures:
    """What the planner's model says of a hit with a speed, gears and pads scaled as simulated."""
    config = load_robot_config()
    brace = needed(config.brace, "brace")
    pad = scales.get("pad_scale", 1.0)
    config = replace(
        config, drives=needed(config.drives, "drives").scaled(gear=scales.get("gear_scale", 1.0)),
        brace=replace(brace, stiffness=pad * brace.stiffness, damping=pad * brace.damping))
    posture, settings = plan.hit.stance.posture, plan.settings
    structure = hit_structure(
        RobotModel(config), posture.base, posture.joints, plan.hit.stance.feet,
        plan.hit.contact.normal)
    leaf = leaf_to_hit(
        known, settings, plan.hit.placement, plan.hit.contact, 0.0, plan.restitution)
    switch = Switch(
        settings.detection_delay + settings.switch_delay, settings.slow_down,
        plan.v_rb_post / plan.v_rb)
    found: HitResponse = HitSimulation(structure, leaf).hit(v_rb, switch)
    return Figures(
        omega=found.omega_end, v_post=found.v_rb_post, mass=found.mass,
        restitution=(found.omega_end * plan.l_b - found.v_rb_post) / v_rb,
        duration=found.duration, peak=found.peak_force, pads=found.pad_force, gear=found.gear,
        before=structure.torque, preload=found.pad_preload)

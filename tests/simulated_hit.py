"""One hit in the simulation beside the planner's simulated hit, for the tests of the hit model."""

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_evaluation.run import evaluation, rehearsal, simulation_log
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config, needed
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.hit_response import HitResponse, HitSimulation, Switch
from impact_planner.hit.hit_structure import hit_structure
from impact_planner.hit.transfer import leaf_to_hit
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import configured_placement, make_settings

_FOLLOWED = 0.05  # time after the start of the contact in which the world is followed [s]
_SETTLED = 10  # samples after the contact over which v'_rB is a mean, as in the planner's model


class _Over(Exception):
    """The hit is over; the rest of the motion is not simulated."""


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


@dataclass(frozen=True)
class Pair:
    """One hit: simulated and predicted."""

    simulated: Figures
    predicted: Figures


class HitLoads:
    """Torques of the gears and force of the pads, before the contact and in each step of it.

    With `ends` the simulation ends some time after the contact began.
    """

    def __init__(self, *, ends: bool = False) -> None:
        self._ends = ends
        self.rows: list[Array] = []
        self.before = np.empty(0)
        self.start = np.inf
        self._world: World | None = None

    def __call__(self, world: World, sample: TickSample) -> None:
        """Watch the world from the first tick on."""
        if self._world is None:
            self._world = world
            world.observers.append(self._add)
        if self._ends and world.time > self.start + _FOLLOWED:
            raise _Over

    def _add(self, engine: Any) -> None:
        world = self._world
        assert world is not None
        if world.time > self.start + _FOLLOWED:
            return
        pads = world.joints.pads
        row = np.append(world.joints.drives.gear, 0.0 if pads is None else pads.force[0])
        if engine.touch().force > evaluation.CONTACT_FORCE:
            self.start = min(self.start, world.time)
            self.rows.append(row)
        elif not self.rows:
            self.before = row


def hit_pair(folder: Path, degrees: float, door: str = "paper", run_up: str = "mcv50",
             **settings: Any) -> Pair:
    """Simulates a hit, and predicts it for the speed of B that the simulation had.

    The log is written to `folder`; `settings` are the world's, the model gets their scales.
    """
    loads, path = HitLoads(ends=True), folder / "hit.npz"

    def watch(world: World, sample: TickSample) -> None:
        try:
            loads(world, sample)
        except _Over:
            world.save_log(path)
            raise

    with suppress(_Over):
        rehearsal.rehearse(degrees, path, door=door, run_up=run_up, watch=watch, **settings)
    known, planner = KnownDoor.configured(load_door(door)), make_settings(configured_placement())
    plan = plan_impact(PlanRequest(np.radians(degrees), run_up=run_up), known,
                       RobotModel(load_robot_config()), planner)
    return pair_of(plan, known, simulation_log.load(path, 0.0), loads, settings)


def pair_of(plan: ImpactPlan, known: KnownDoor, log: simulation_log.SimulationLog,
            loads: HitLoads, settings: dict[str, Any]) -> Pair:
    """A simulated hit, from its log and its loads, and its prediction."""
    motion = log.motion
    hit = evaluation.impact(motion, plan.l_b)
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
    return Pair(simulated, _predicted(plan, known, hit.v_rb, settings))


def _predicted(
    plan: ImpactPlan, known: KnownDoor, v_rb: float, scales: dict[str, Any]
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
    leaf = leaf_to_hit(known, settings, plan.hit.contact, 0.0, plan.restitution)
    switch = Switch(
        settings.detection_delay + settings.switch_delay, settings.slow_down,
        plan.v_rb_post / plan.v_rb)
    found: HitResponse = HitSimulation(structure, leaf).hit(v_rb, switch)
    return Figures(
        omega=found.omega_end, v_post=found.v_rb_post, mass=found.mass,
        restitution=(found.omega_end * plan.l_b - found.v_rb_post) / v_rb,
        duration=found.duration, peak=found.peak_force, pads=found.pad_force, gear=found.gear,
        before=structure.torque, preload=found.pad_preload)

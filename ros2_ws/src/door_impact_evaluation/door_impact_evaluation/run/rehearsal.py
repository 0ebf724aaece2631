"""Run a whole hit in the simulation without nodes: planner, mission, driver, physics."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from door_model.door.config import DoorConfig, load_door
from door_model.errors import DoorModelError
from hrp2_description.robot import RobotConfig, load_robot_config
from hrp2_sim_bridge.sensors.sensors import TickSample
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import ImplausibleHit
from impact_planner.hit.learning import learn
from impact_planner.hit.placement import configured_placement, configured_settings
from impact_planner.impact_plan import ImpactPlan, observed_hit
from impact_planner.plan import plan_impact
from impact_planner.task.experience import Experience
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from motion_execution.hit.execution import Execution
from motion_execution.mission.mission import HIT
from motion_execution.mission.order import Order

from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.driver_link import DriverLink, hit_plan_of
from door_impact_evaluation.run.mirrored_world import MirroredWorld

Watch = Callable[[World, TickSample], None]
"""Function that is called after each tick with the world and the sample of its sensors."""

LONGEST = 40.0  # simulated time after which a run ends [s]


@dataclass(frozen=True)
class Rehearsal:
    """A whole motion and its results.

    Attributes:
        plan: Plan that was executed.
        execution: Execution of the plan, after its end.
        log: The simulation's log.
        impact: The hit; None if the robot did not hit the door.
        known: What the planner knew of the door.
        robot: The robot.
    """

    plan: ImpactPlan
    execution: Execution
    log: simulation_log.SimulationLog
    impact: evaluation.Impact | None
    known: KnownDoor
    robot: RobotConfig

    def phases(self) -> dict[str, tuple[float, float]]:
        """Return start and end of each phase in order of time [s].

        The run-up ends at the first contact, or where the motion turns back without one.
        """
        t, ending = self.log.motion.t, self.plan.phases[-1].name
        starts = [(start, name) for name, start in self.execution.starts.items()
                  if self.impact is None or name not in ("post", ending)]
        if self.impact is not None:
            starts += [(float(t[self.impact.contact.start]), "post"),
                       (float(t[self.impact.peak]), ending)]
        ends = [start for start, _ in starts[1:]] + [float(t[-1])]
        return {name: (start, end) for (start, name), end in zip(starts, ends, strict=True)}

    def learned(self) -> Experience:
        """Return what the executor's measurements teach about the next hit on this door."""
        before = self.known.experience or Experience.none(self.plan.restitution)
        try:
            hit = observed_hit(self.plan, self.known, self.execution.measured)
            return learn(before, hit, self.plan.settings.learning_limits)
        except (DoorModelError, ImplausibleHit):  # for instance because no hit was detected
            return before


def rehearse(
    target_deg: float, path: str | Path, *, door: str | DoorConfig = "paper",
    known: KnownDoor | None = None, door_offset: float = 0.0, run_up: str = "mcv50",
    ending: str = "hold", stop_before: float | None = None, watch: Watch | None = None,
    probe: str = "off", robot: RobotModel | None = None, **settings: Any,
) -> Rehearsal:
    """Plan a hit and execute it; the execution gets the sensor data that a robot would send.

    Args:
        target_deg: Desired opening angle [deg].
        path: File for the simulation's log.
        door: The simulated door, or its name or file.
        known: What the planner knows of the door; None means that it knows the configured door.
        door_offset: Distance by which the door stands farther away than surveyed [m].
        run_up: Profile of the run-up, mcv50 or zmp_limited.
        ending: Motion after the door's peak, hold, retreat or pass.
        stop_before: Time before the planned contact at which a stop is requested [s]; None means
            no stop.
        watch: Function that is called after each tick.
        probe: Whether the leaf is touched slowly first: on, off, or auto where the plan's
            `missed_margin` asks for it.
        robot: The robot; None means HRP-2.
        settings: Settings of the simulated world (`WorldSettings`).

    Raises:
        PlannerError: There is no such plan.
        SettingError: A setting of the world is out of its range.
    """
    config = load_door(door) if isinstance(door, str) else door
    robot, known = robot or RobotModel(load_robot_config()), known or KnownDoor.configured(config)
    plan = planned(robot, known, target_deg, run_up, ending)
    world = world_of(robot, config, door_offset, **settings)
    try:
        execution = execute(world, robot, plan, watch, stop_before, probe=probe)
        log = simulation_log.load(world.save_log(path), 0.0)
    finally:
        world.close()
    return Rehearsal(
        plan, execution, log, impact_of(plan, execution, log), known, robot.config)


def planned(
    robot: RobotModel, known: KnownDoor, target_deg: float, run_up: str, ending: str,
) -> ImpactPlan:
    """Plan a hit; arguments and errors are those of `rehearse`."""
    return plan_impact(PlanRequest(np.radians(target_deg), run_up=run_up, ending=ending), known,
                       robot, configured_settings(robot))


def world_of(robot: RobotModel, door: DoorConfig, door_offset: float, **settings: Any) -> World:
    """Make a world with a door; arguments and errors are as of `rehearse`."""
    kind, place = MirroredWorld if door.hinge == "left" else World, configured_placement(robot)
    return kind(robot.config, door, door_offset + place.door_distance, place.hinge_x,
                **settings)


def execute(
    world: World, robot: RobotModel, plan: ImpactPlan, watch: Watch | None = None,
    stop_before: float | None = None, *, probe: str = "off",
) -> Execution:
    """Execute a plan in a world whose robot stands in half-sitting, until it ends or falls.

    Args:
        world: The world.
        robot: The robot.
        plan: The plan.
        watch: As of `rehearse`, as are `stop_before` and `probe`.

    Raises:
        GoalRefused: It cannot be executed.
        NotReady: The world's sensors contradict each other.
    """
    link, stops = DriverLink(world, robot, encoder_bits=world.settings.encoder_bits), [stop_before]
    mission = link.mission

    def after(sample: TickSample) -> None:
        if watch is not None:
            watch(world, sample)
        hit = mission.body.motion
        if stops[0] is not None and isinstance(hit, Execution) and (
                sample.time > hit.planned_contact - stops[0]):
            mission.stop()
            stops[0] = None

    link.watches.append(after)
    execution: Execution = link.run(
        mission.hit(hit_plan_of(plan), Order(HIT), probe=probe), LONGEST)
    return execution


def impact_of(
    plan: ImpactPlan, execution: Execution, log: simulation_log.SimulationLog
) -> evaluation.Impact | None:
    """Measure the hit in a log; None if the robot did not hit the door."""
    begin = execution.starts.get("cam", np.inf)
    touched = log.motion.contact_force[log.motion.t >= begin] > evaluation.CONTACT_FORCE
    return evaluation.impact(log.motion, plan.l_b, begin) if touched.any() else None

"""Run a whole motion in the simulation without nodes: planner, execution, driver, physics."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from door_encoder.decoding.angle import AnglePoint, AngleSampler
from door_encoder.decoding.decoder import EncoderDecoder
from door_encoder.decoding.settings import Settings
from door_impact_common.arrays import Array
from door_model.door.config import DoorConfig, load_door
from door_model.errors import DoorModelError
from door_model.recording.batch import SampleBatcher
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.control.trajectory import TrajectoryArrays
from hrp2_sim_bridge.sensors.sensors import COUNTS_PER_TURN, TickSample
from hrp2_sim_bridge.settings import SAMPLE
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import ImplausibleHit
from impact_planner.hit.learning import learn
from impact_planner.impact_plan import ImpactPlan, observed_hit
from impact_planner.plan import plan_impact
from impact_planner.task.experience import Experience
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import configured_placement, make_settings
from motion_execution.hit.execution import Command, ExecutablePlan, Execution
from motion_execution.hit.point_b import PointB
from robot_driver.motion import Outcome

from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.mirrored_world import MirroredWorld

Watch = Callable[[World, TickSample], None]
"""Function that is called after each tick with the world and the sample of its sensors."""

BATCH = 20  # samples of the door's encoder
LONGEST = 40.0  # simulated time after which a run ends [s]
AFTERWARDS = 2.0  # simulated time after the end of the execution, in which a fall would show [s]


@dataclass(frozen=True)
class Rehearsal:
    """A whole motion and its results.

    Attributes:
        plan: Plan that was executed.
        execution: Execution of the plan, after its end.
        log: The simulation's log.
        impact: The hit; None if the robot did not hit the door.
        known: What the planner knew of the door.
    """

    plan: ImpactPlan
    execution: Execution
    log: simulation_log.SimulationLog
    impact: evaluation.Impact | None
    known: KnownDoor

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
    probe: str = "off", **settings: Any,
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
        settings: Settings of the simulated world (`WorldSettings`).

    Raises:
        PlannerError: There is no such plan.
        SettingError: A setting of the world is out of its range.
    """
    config = load_door(door) if isinstance(door, str) else door
    robot, known = RobotModel(load_robot_config()), known or KnownDoor.configured(config)
    plan = planned(robot, known, target_deg, run_up, ending)
    world = world_of(robot, config, plan.hit.placement.hinge, door_offset, **settings)
    probes = probe == "on" or (probe == "auto" and not plan.stands_if_missed)
    try:
        execution = execute(
            world, plan, PointB(robot), watch or (lambda *_: None), stop_before, probe=probes)
        log = simulation_log.load(world.save_log(path), 0.0)
    finally:
        world.close()
    return Rehearsal(plan, execution, log, impact_of(plan, execution, log), known)


def planned(
    robot: RobotModel, known: KnownDoor, target_deg: float, run_up: str, ending: str,
    **place: float,
) -> ImpactPlan:
    """Plan a hit; `place` may have door_distance and l_b of `PlanRequest`, otherwise as surveyed.

    Further arguments and errors are those of `rehearse`.
    """
    return plan_impact(
        PlanRequest(np.radians(target_deg), run_up=run_up, ending=ending, **place), known, robot,
        make_settings(configured_placement()))


def world_of(
    robot: RobotModel, door: DoorConfig, hinge: Array, door_offset: float, **settings: Any
) -> World:
    """Make a world with a door whose hinge is surveyed at x, y of odom, (2,) [m].

    The other arguments and errors are as of `rehearse`.
    """
    kind = MirroredWorld if door.hinge == "left" else World
    return kind(robot.config, door, door_offset - float(hinge[1]), float(hinge[0]), **settings)


def impact_of(
    plan: ImpactPlan, execution: Execution, log: simulation_log.SimulationLog
) -> evaluation.Impact | None:
    """Measure the hit in a log; None if the robot did not hit the door."""
    begin = execution.starts.get("cam", np.inf)
    touched = log.motion.contact_force[log.motion.t >= begin] > evaluation.CONTACT_FORCE
    return evaluation.impact(log.motion, plan.l_b, begin) if touched.any() else None


def arrays_of(command: Command, names: Sequence[str]) -> TrajectoryArrays:
    """Return the trajectory of a command as the driver receives it.

    Args:
        command: The command.
        names: Joint names in the order of the knots' columns.
    """
    knots = command.knots
    if knots is None:
        return TrajectoryArrays((), (), ())
    return TrajectoryArrays(
        names, knots.time.tolist(), knots.position.tolist(), knots.velocity.tolist(),
        knots.acceleration.tolist())


def execute(
    world: World, plan: ImpactPlan, point_b: PointB, watch: Watch, stop_before: float | None,
    *, probe: bool = False, encoder: "DoorEncoder | None" = None, afterwards: float = AFTERWARDS,
) -> Execution:
    """Execute a plan in a world whose robot stands in half-sitting, until it ends or falls.

    Args:
        world: The world.
        plan: The plan.
        point_b: Speed of point B, and the door's direction for the IMU.
        watch: Function that is called after each tick.
        stop_before: Time before the planned contact at which a stop is requested [s]; None means
            no stop.
        probe: Whether the leaf is touched slowly first.
        encoder: Encoder of the door, closed at its first sample; None means a new one.
        afterwards: Simulated time after the end of the execution [s].
    """
    def send(command: Command) -> None:
        world.follow(arrays_of(command, world.robot_config.joint_names), command.stamp)

    execution = Execution(
        ExecutablePlan.of(plan, {phase.name: phase.knots for phase in plan.all_phases}),
        point_b, probe=probe)
    send(execution.start(world.step().time))
    end = world.time + LONGEST
    encoder = encoder or DoorEncoder(world.settings.encoder_bits)
    while not world.fell and world.time < end:
        sample = world.step()
        watch(world, sample)
        points = encoder.take(sample)
        if execution.outcome is not Outcome.RUNNING:
            end = min(end, world.time + afterwards)
            continue
        if stop_before is not None and sample.time > execution.planned_contact - stop_before:
            execution.stop()
            stop_before = None
        for command in (
                *execution.on_imu(sample.time, sample.imu),
                *execution.on_joints(sample.time, sample.position, sample.velocity),
                *execution.on_wrenches(sample.time, sample.left_wrench, sample.right_wrench),
                *execution.on_measured(sample.time, sample.measured)):
            send(command)
        for point in points:
            for command in execution.on_door(1e-9 * point.stamp_ns, point.theta, point.omega):
                send(command)
    return execution


class DoorEncoder:
    """The door's encoder and its decoder, as in the node door_encoder, in batches of 20 ms."""

    def __init__(self, bits: int) -> None:
        settings = Settings(counts_per_turn=COUNTS_PER_TURN, modulus=1 << bits)
        self._decoder = EncoderDecoder(settings)
        self._sampler = AngleSampler(radians_per_count=settings.radians_per_count)
        self._batcher = SampleBatcher(
            period_ns=round(1e9 * SAMPLE), size=BATCH, counts_per_turn=COUNTS_PER_TURN)

    def take(self, sample: TickSample) -> list[AnglePoint]:
        """Return the angles that a tick completes."""
        batch = self._batcher.add(sample.counts, round(1e9 * sample.time))
        if batch is None:
            return []
        return [point for decoded in self._decoder.decode(batch)
                for point in self._sampler.take(decoded)]

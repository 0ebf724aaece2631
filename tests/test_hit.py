"""The hit in the simulation, without nodes: planner, execution, driver and physics together."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from door_impact_bringup import evaluation, simulation_log
from door_model.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.trajectory import TrajectoryArrays
from hrp2_sim_bridge.world import World
from impact_planner.execution import Command, ExecutablePlan, Execution, Outcome
from impact_planner.plan import plan_impact
from impact_planner.plan_types import ImpactPlan, KnownDoor, PlanRequest
from impact_planner.point_b import PointB
from impact_planner.robot_model import RobotModel
from impact_planner.settings import configured_placement, make_settings

PLACEMENT = configured_placement()
ENCODER_DELAY = 4  # ticks until an angle of the door is heard: batches of 20 ms


@dataclass
class Run:
    """A whole motion and what became of it."""

    plan: ImpactPlan
    execution: Execution
    log: simulation_log.SimulationLog
    impact: evaluation.Impact


def play(target_deg: float, path: Any) -> Run:
    """Plans and executes; the execution hears what a robot would tell it."""
    config, door = load_robot_config(), load_door("paper")
    robot = RobotModel(config)
    plan = plan_impact(
        PlanRequest(np.radians(target_deg)), KnownDoor(door.name, door.door(), door.leaf.width),
        robot, make_settings(PLACEMENT))
    world = World(config, door, **PLACEMENT)

    def send(command: Command) -> None:
        knots = command.knots
        message = TrajectoryArrays((), (), ()) if knots is None else TrajectoryArrays(
            config.joint_names, knots.time, knots.position, knots.velocity, knots.acceleration)
        world.driver.accept(message, command.stamp, world.time)

    execution = Execution(
        ExecutablePlan({phase.name: phase.knots for phase in plan.phases}, plan.contact_time,
                       plan.switch_time, plan.v_com_post / plan.v_com, plan.point_of_no_return,
                       np.radians(target_deg)),
        PointB(robot).speed)
    send(execution.start(world.step().time))
    heard: list[tuple[float, float, float]] = []
    while execution.outcome is Outcome.RUNNING and not world.fell and world.time < 30.0:
        sample = world.step()
        for command in execution.on_joint_state(sample.time, sample.position, sample.velocity):
            send(command)
        heard.append((sample.time, world.door_state.angle, world.door_state.velocity))
        if len(heard) > ENCODER_DELAY:
            for command in execution.on_door(*heard.pop(0)):
                send(command)
    world.save_log(path)
    world.close()
    log = simulation_log.load(path, 0.0)
    return Run(plan, execution, log, evaluation.impact(log.motion, plan.l_b))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return play(25.0, tmp_path_factory.mktemp("hit") / "run.npz")


def test_the_door_opens_to_the_desired_angle(run: Run) -> None:
    assert np.degrees(run.log.motion.door_angle[run.impact.peak]) == pytest.approx(25.0, abs=2.5)


def test_a_smaller_angle_is_reached_too(tmp_path: Any) -> None:
    other = play(16.0, tmp_path / "run.npz")
    peak = np.degrees(other.log.motion.door_angle[other.impact.peak])
    assert peak == pytest.approx(16.0, abs=2.5)
    assert not other.log.fell


def test_the_robot_stands_and_touches_the_door_once(run: Run) -> None:
    assert run.execution.outcome is Outcome.SUCCESS
    assert run.log.fell == ""
    assert run.impact.contacts_before_peak == 1


def test_the_impulse_on_the_door_is_its_angular_momentum(run: Run) -> None:
    motion, contact = run.log.motion, run.impact.contact
    force = motion.contact_force[contact.start:contact.end]
    impulse = force.sum() * 0.001 * run.plan.l_b
    assert impulse == pytest.approx(run.log.i_a * run.impact.omega_door, rel=0.03)


def test_momentum_from_measured_speeds_is_that_of_eq_2(run: Run) -> None:
    robot = run.plan.effective_mass * (run.impact.v_rb - run.impact.v_rb_post) * run.plan.l_b
    assert robot == pytest.approx(run.log.i_a * run.impact.omega_door, rel=0.06)


def test_the_speed_of_b_is_the_planned_one(run: Run) -> None:
    assert run.impact.v_rb == pytest.approx(run.plan.v_rb, rel=0.02)


def test_the_feet_do_not_slip(run: Run) -> None:
    after = run.log.motion.t[run.impact.contact.start]
    assert evaluation.slip(run.log.motion, after - 0.1, after + 1.0) < 0.002


def test_the_zmp_stays_inside_the_support_polygon(run: Run) -> None:
    motion = run.log.motion
    inside = (motion.t > 0.1) & (motion.t < motion.t[-1] - 0.05)
    support = evaluation.support(motion, load_robot_config(), window=evaluation.WINDOW)
    assert np.nanmin(support.margin[inside]) > 0.0


def test_the_door_is_held_near_the_desired_angle(run: Run) -> None:
    assert np.degrees(run.log.motion.door_angle[-300:].mean()) == pytest.approx(25.0, abs=2.0)

"""The mission of the node motion_server, before the kinematic double of a driver."""

import math

import numpy as np
import pytest
from door_impact_evaluation.run.driver_link import DriverLink
from door_impact_evaluation.run.rehearsal import planned
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.placement import configured_placement
from impact_planner.task.known_door import KnownDoor
from kinematic_robot import KinematicRobot, Leaf
from motion_execution.mission.link import HitRequest
from motion_execution.mission.mission import HIT, PASSAGE, WALK
from motion_execution.mission.order import Order
from motion_execution.mission.passing import Passed
from motion_execution.mission.ways import Wanted
from motion_execution.walk.goal import WalkGoal
from reference_door import ReferenceDoor
from robot_driver.motion import Outcome
from walking.errors import InvalidFootsteps, InvalidGoal, NotReady, WalkInfeasible
from walking.footsteps.footstep import Pose

LONGEST = 30.0  # [s]


@pytest.fixture
def link() -> DriverLink:
    """Before a door that answers the hit to 25 deg as it is planned."""
    door, robot = load_door("paper"), RobotModel(load_robot_config())
    known = KnownDoor.configured(door)
    plan = planned(robot, known, 25.0, "mcv50", "hold")
    linkage = {name: getattr(door.linkage, name) for name in ("l", "l1", "l2", "l3", "theta_i0")}
    leaf = Leaf(ReferenceDoor(door.i_a, door.c_c, door.k_c, door.tau_c0_prime, linkage=linkage),
                configured_placement(robot).hinge, door.leaf.width,
                plan.effective_mass, plan.apparent_restitution)
    return DriverLink(KinematicRobot(leaf), robot, known)


def test_nothing_begins_beside_a_hit_and_a_walk_after_it_folds_the_arm_and_lets_the_leaf_go(
        link: DriverLink) -> None:
    """The robot arrives in half-sitting, and the door is shut; through it no way leads."""
    plan = link.plan_hit(HitRequest(math.radians(25.0), "hold", "", -1.0, -1.0)).result()
    other = []

    def order(_: object) -> None:
        if link.mission.body.motion is not None and not other:
            other.append(link.mission.run(
                link.mission.walk(WalkGoal(Pose(1.0, 0.0, 0.0)), Order(WALK))))

    link.watches.append(order)
    hit = link.run(link.mission.hit(plan, Order(HIT)), LONGEST)
    assert (hit.outcome, hit.reason) == (Outcome.SUCCESS, "")
    assert math.degrees(hit.measured.peak_angle) == pytest.approx(25.0, abs=3.0)
    with pytest.raises(NotReady, match="hit is being executed"):
        other[0].result()
    joints = link.inputs.joints
    assert joints is not None
    assert link.robot.folded_by(joints[1]) > 1.0
    with pytest.raises(WalkInfeasible, match="in the way after"):
        link.run(link.mission.walk(WalkGoal(Pose(0.0, -2.0, 0.0)), Order(WALK)), LONGEST)
    walk = link.run(link.mission.walk(WalkGoal(Pose(0.2, 0.0, 0.0)), Order(WALK)), LONGEST)
    assert (walk.outcome, walk.reason) == (Outcome.SUCCESS, "")
    assert link.robot.folded_by(link.inputs.joints[1]) < 0.01
    assert link.inputs.door_angle == pytest.approx(0.0, abs=0.01)
    assert not link.refused


def test_a_controller_that_is_activated_anew_ends_the_hit_standing(link: DriverLink) -> None:
    """It holds what it measures, and says so; the trajectory under way is not taken up again."""
    plan = link.plan_hit(HitRequest(math.radians(25.0), "hold", "", -1.0, -1.0)).result()
    held: list[np.ndarray] = []

    def activate(sample: TickSample) -> None:
        motion = link.mission.body.motion
        if held or (motion is not None and motion.phase == "shift" and sample.velocity.any()):
            if not held:
                held.append(sample.position + 0.02)
                link.driver._controller.reset(held[0], sample.time)
            link.mission.body.follows(sample.time, held[0])

    link.watches.append(activate)
    hit = link.run(link.mission.hit(plan, Order(HIT)), LONGEST)
    assert hit.outcome is Outcome.NOT_FOLLOWED
    assert "was it activated anew" in hit.reason
    np.testing.assert_allclose(link.inputs.joints[1], held[0], atol=1e-9)


def test_a_walk_goes_on_after_a_bad_newer_goal_and_is_stopped_standing(link: DriverLink) -> None:
    """Both are said; nothing begins while the robot lies."""
    walk = link.mission.run(link.mission.walk(WalkGoal(Pose(0.6, 0.0, 0.0)), Order(WALK)))
    while link.mission.body.motion is None:
        link.step()
    with pytest.raises(InvalidFootsteps, match=r"; the walk under way goes on$"):
        link.run(link.mission.walk(WalkGoal(Pose(math.nan, 0.0, 0.0)), Order(WALK)), LONGEST)
    assert not walk.done
    assert "stands on two feet" in link.mission.stop()
    while not walk.done:
        link.step()
    assert walk.result().outcome is Outcome.STOPPED
    assert walk.result().steps_made(math.inf) < 2
    assert link.mission.stop() == "nothing is being executed"
    link.mission.body.inputs.tilt = 1.5
    with pytest.raises(NotReady, match=r"the robot fell: .* 85\.9 deg, .*sim/reset"):
        link.mission.body.require_messages(())


def test_an_angle_that_makes_no_sense_is_refused_before_anything_is_planned(
        link: DriverLink) -> None:
    for angle in (math.nan, 0.0, 2.0):
        with pytest.raises(InvalidGoal, match="hit_angle"):
            link.run(link.mission.pass_door(
                Wanted(hit_angle=angle), Order(PASSAGE), Passed()), LONGEST)
    assert not link.plans

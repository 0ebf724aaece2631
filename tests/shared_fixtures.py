"""The robot, doors and plans that the tests of several packages look at, each made once."""

import math

import numpy as np
import pytest
from door_model.door.config import load_door
from door_model.door.geometry import Frame, Leaf
from hrp2_description.robot import load_robot_config
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import solve
from impact_planner.hit.stance import stance_for_step
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from motion_execution.hit.types import ExecutablePlan
from walking.footsteps.footstep import Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.passing.arm_course import ArmCourse, ArmTask
from walking.passing.doorway import Doorway
from walking.passing.passage import plan_passage
from walking.passing.passage_task import PassageTask
from walking.pattern.plan import plan_walk
from walking.pattern.state import standing

HELD = np.radians(15.0)


@pytest.fixture(scope="session")
def robot():
    """The model of HRP-2."""
    return RobotModel(load_robot_config())


@pytest.fixture(scope="session")
def half_sitting(robot):
    """The soles in half-sitting, with their middle in the origin."""
    return Stance.around(Pose(0.0, 0.0, 0.0), robot.config.footsteps.width)


@pytest.fixture(scope="session")
def walk_to(robot, half_sitting):
    """A function that plans a walk from half-sitting to x, y [m] and yaw [deg]."""

    def walk(x, y, yaw_deg, **options):
        goal = Pose(x, y, math.radians(yaw_deg))
        footsteps = plan_footsteps(robot.config, half_sitting, goal, **options)
        return plan_walk(robot, standing(robot, half_sitting), footsteps)

    return walk


@pytest.fixture(scope="session")
def arc(walk_to):
    """A walk ahead and to the left that ends turned by 60 deg."""
    return walk_to(1.0, 0.4, 60.0)


@pytest.fixture(scope="session")
def doorway():
    """A function that returns a leaf of some width [m] in its frame; the face is 0.715 m away."""
    return lambda width=0.896, threshold=0.0: Doorway(
        np.array([-0.4056, -0.715]), Leaf(50.0, width, 2.0, 0.04),
        Frame(width + 0.004, 0.10, 0.14, threshold))


def holding(robot, door):
    """The soles as after a hit, and joints with the hand on the leaf."""
    stance = Stance(Pose(0.0, 0.095, 0.0), Pose(0.0, -0.30, 0.0))
    half, count = robot.config.half_sitting, 30
    feet = {"left": np.array([0.0, 0.095, 0.0]), "right": np.array([0.0, -0.30, 0.0])}
    arm = ArmCourse(robot)
    joints = half.copy()
    for _ in range(3):  # the arm moves the CoM a little
        whole, base = solve(robot, upper=joints, com_xy=np.array([[0.01, -0.24]]),
                            waist_z=0.55, feet=feet)
        task = ArmTask(
            time=0.1 * np.arange(count), joints=np.tile(whole[0], (count, 1)),
            base=np.tile(base[0], (count, 1)), yaw=np.zeros(count),
            leaf=LeafFrame(door.hinge, np.full(count, HELD)), holds=np.ones(count, dtype=bool),
            gap=np.full(count, robot.hand_radius), radii=(0.3, 0.82),
            radius=0.72, heights=(0.75, 1.25), others=(0.08, 0.05),
            comfortable=half[arm.columns])
        found = arm.solve(task, joints[arm.columns])
        joints = whole[0].copy()
        joints[arm.columns] = found[-1]
    whole, _ = solve(robot, upper=joints, com_xy=np.array([[0.01, -0.24]]), waist_z=0.55, feet=feet)
    return stance, whole[0]


@pytest.fixture(scope="session")
def task(robot, doorway):
    """The paper's door, held at 15 deg."""
    stance, joints = holding(robot, doorway())
    return PassageTask(load_door("paper").door(), doorway(), float(HELD), stance, joints)


@pytest.fixture(scope="session")
def passage(robot, task):
    """The passage through the paper's door."""
    return plan_passage(robot, task)


@pytest.fixture(scope="session")
def stance(robot):
    """The stance after the nominal step."""
    return stance_for_step(robot, robot.config.step.nominal, 0.01)


@pytest.fixture(scope="session")
def known():
    """The paper's door with exactly known parameters."""
    return KnownDoor.configured(load_door("paper"))


@pytest.fixture(scope="session")
def plan(robot, known):
    """The plan that opens the paper's door to 25 deg at its nominal place."""
    return plan_impact(PlanRequest(np.radians(25.0)), known, robot)


@pytest.fixture(scope="session")
def good(plan):
    """This plan, ready for an execution."""
    return ExecutablePlan.of(plan, {phase.name: phase.knots for phase in plan.all_phases})

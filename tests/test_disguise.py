"""A robot is what its files say: HRP-2 by other names plans and does what HRP-2 does."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from disguise import Disguise, disguised
from door_impact_evaluation.run.rehearsal import execute, planned, world_of
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.settings import ENGINES
from humanoid_motion.robot_model import RobotModel
from impact_planner.task.known_door import KnownDoor
from robot_driver.motion import Outcome

DOOR = load_door("paper")
PLAIN = RobotModel(load_robot_config())
EXACT = {"sensor_noise": False}


@pytest.fixture(scope="module")
def disguise(tmp_path_factory: pytest.TempPathFactory) -> Disguise:
    return disguised(tmp_path_factory.mktemp("disguise"))


@pytest.fixture(scope="module")
def plans(disguise: Disguise) -> tuple[Any, Any]:
    known = KnownDoor.configured(DOOR)
    plain, other = (planned(robot, known, 20.0, "mcv50", "hold")
                    for robot in (PLAIN, RobotModel(disguise.config)))
    return plain, other


def test_the_plan_is_the_same(disguise: Disguise, plans: tuple[Any, Any]) -> None:
    """All knots are, within 1e-9 rad."""
    for plain, other in zip(*(plan.phases for plan in plans), strict=True):
        np.testing.assert_allclose(
            other.knots.position[:, disguise.order], plain.knots.position, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_push_moves_it_alike(disguise: Disguise, engine: str) -> None:
    """In 0.25 s after a push, joints, IMU and feet are the same."""
    logs = []
    for robot in (PLAIN, RobotModel(disguise.config)):
        world = world_of(robot, DOOR, 0.0, engine=engine, sensors=EXACT)
        world.push_robot(np.array([3.0, 2.0, 0.0]))
        for _ in range(50):
            sample = world.step()
        logs.append(world.log() | {"sample": sample})
        world.close()
    plain, other = logs
    assert plain["max_tilt"] > 0.001
    np.testing.assert_allclose(other["q"][:, disguise.order], plain["q"], atol=1e-6)
    for name in ("left_wrench", "right_wrench", "base_position", "base_quaternion"):
        np.testing.assert_allclose(other[name], plain[name], atol=1e-3, err_msg=name)
    for foot in ("left_wrench", "right_wrench"):
        np.testing.assert_allclose(
            getattr(other["sample"], foot), getattr(plain["sample"], foot), atol=1e-3)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_robot_may_have_any_number_of_joints(tmp_path: Path, engine: str) -> None:
    """HRP-2 with a stiff neck stands, and its log has 28 joints."""
    robot = RobotModel(disguised(tmp_path, fixed=("HEAD_JOINT0", "HEAD_JOINT1")).config)
    world = world_of(robot, DOOR, 0.0, engine=engine)
    for _ in range(20):
        world.step()
    assert world.log()["q"].shape == (100, 28)
    assert not world.fell
    world.close()


@pytest.mark.nightly("two whole runs of their own")
@pytest.mark.parametrize(("engine", "near"), [("mujoco", 1e-6), ("pybullet", 0.05)])
def test_it_opens_the_door_as_far(
        disguise: Disguise, plans: tuple[Any, Any], engine: str, near: float) -> None:
    """MuJoCo to 1e-6 deg; PyBullet's solver amplifies the last bit to some 0.002 deg."""
    peaks = []
    for robot, plan in zip((PLAIN, RobotModel(disguise.config)), plans, strict=True):
        world = world_of(robot, DOOR, 0.0, engine=engine, sensors=EXACT)
        assert execute(world, robot, plan).outcome is Outcome.SUCCESS
        peaks.append(np.degrees(world.log()["door_angle"].max()))
        world.close()
    assert peaks[1] == pytest.approx(peaks[0], abs=near)

"""A world with a door hinged at the left, as the robot's mirror image sees it."""

from dataclasses import replace

import numpy as np
import pytest
from door_impact_evaluation.run.mirrored_world import MirroredWorld
from door_impact_evaluation.run.record import Motion
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.settings import SensorSettings
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.mirror import Mirror

CONFIG = load_robot_config()
LEFT = replace(load_door("paper"), hinge="left")


@pytest.fixture
def world():
    """Such a world without noise; it is closed afterwards."""
    made = MirroredWorld(CONFIG, LEFT, 0.9, -0.42, engine="mujoco",
                         sensors=SensorSettings(sensor_noise=False))
    yield made
    made.close()


def test_orders_and_measurements_are_those_of_the_image(world):
    """The image bends its right elbow and lifts this arm; the robot in the log does so at left."""
    goal = np.array(CONFIG.half_sitting)
    elbow, roll = CONFIG.index("RARM_JOINT3"), CONFIG.index("RARM_JOINT1")
    goal[elbow] -= 0.4
    goal[roll] -= 0.2
    zero = [[0.0] * 30] * 2
    world.follow(TrajectoryArrays(
        CONFIG.joint_names, (0.05, 0.8), [list(CONFIG.half_sitting), goal.tolist()], zero, zero),
        0.0)
    for _ in range(200):
        sample = world.step()
    np.testing.assert_allclose(world.commanded, goal, atol=1e-9)
    np.testing.assert_allclose(sample.position, goal, atol=0.03)  # the knees give
    true = world.log()["q"][-1]
    assert true[CONFIG.index("LARM_JOINT3")] == pytest.approx(goal[elbow], abs=0.02)
    assert true[CONFIG.index("LARM_JOINT1")] == pytest.approx(-goal[roll], abs=0.02)
    assert true[elbow] == pytest.approx(CONFIG.half_sitting[elbow], abs=0.02)
    assert sample.imu.specific_force[2] == pytest.approx(9.81, abs=0.1)


def test_pushes_and_hands_change_sides(world, monkeypatch):
    """A push of the image towards x moves the robot towards -x; its left hand yields."""
    world.push_robot(np.array([20.0, -15.0, 0.0]))
    asked = []
    monkeypatch.setattr(world.hands, "comply", lambda side, *_: asked.append(side))
    world.comply("right", 400.0)
    assert asked == ["left"]
    for _ in range(40):
        sample = world.step()
    log = world.log()
    assert log["com_velocity"][:, 0].min() < -0.05
    assert log["com_velocity"][:, 1].min() < -0.05
    assert log["left_wrench"][-1, 2] > log["right_wrench"][-1, 2] + 50.0  # the door is at the left
    np.testing.assert_allclose(sample.right_wrench[2], log["left_wrench"][-1, 2], rtol=0.3)


def test_a_motion_reflected_twice_is_the_motion():
    """Once, its feet change sides, and the door's angle stays."""
    random, mirror = np.random.default_rng(3), Mirror(CONFIG)
    shapes = {"left_wrench": 6, "right_wrench": 6, "left_sole": 3, "right_sole": 3,
              "base_orientation": 4, "joints": 30, "base_position": 3, "com": 3}
    motion = Motion(**{name: random.normal(size=(5, shapes.get(name, 1)))
                       for name in Motion.__dataclass_fields__})
    once = motion.reflected(mirror)
    np.testing.assert_array_equal(once.left_sole, motion.right_sole * [-1.0, 1.0, 1.0])
    assert once.door_angle is motion.door_angle
    for name in Motion.__dataclass_fields__:
        np.testing.assert_allclose(
            getattr(once.reflected(mirror), name), getattr(motion, name), atol=1e-12)

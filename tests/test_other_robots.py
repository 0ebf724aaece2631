"""Robots that are not HRP-2 do the job by configuration alone."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import rehearse
from door_impact_view.scene.urdf import read_urdf
from door_model.door.config import load_door
from hrp2_description.data import data_path, share_folders
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.physics.shapes import simulated_urdf
from hrp2_sim_bridge.settings import ENGINES
from hrp2_sim_bridge.world import World
from humanoid_motion.pinocchio_model import free_floating_model
from humanoid_motion.robot_model import RobotModel

pytestmark = pytest.mark.skipif(
    not any(folder.is_dir() for folder in share_folders("example-robot-data")),
    reason="example-robot-data is not installed")


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["talos", "g1"])
def test_they_stand_on_what_they_weigh(name: str, engine: str) -> None:
    """Both soles bear the weight within 0.1 %, and the ZMP is below the CoM within 2 mm."""
    robot = load_robot_config(name)
    world = World(robot, load_door("paper"), 2.0, -0.4, engine=engine,
                  sensors={"sensor_noise": False})
    for _ in range(200):
        sample = world.step()
    wrenches = np.array([sample.left_wrench, sample.right_wrench])
    assert wrenches[:, 2].sum() == pytest.approx(robot.mass * GRAVITY, rel=1e-3)
    model = RobotModel(robot)
    q = model.configuration(np.zeros(3), sample.position)
    soles = np.array([model.frame_position(q, model.feet[side].frame) for side in model.feet])
    ahead = (wrenches[:, 2] @ soles[:, 0] - wrenches[:, 4].sum()) / wrenches[:, 2].sum()
    assert ahead == pytest.approx(model.com(q)[0], abs=2e-3)
    assert not world.fell
    world.close()


def test_other_joints_are_fixed_and_meshes_found() -> None:
    """Talos' URDF has 44 joints; 28 move in what every reader gets, and each mesh has a path.

    Its hulls are computed once, not at each reset of a world.
    """
    robot = load_robot_config("talos")
    model = free_floating_model(robot)
    assert model.nv == 6 + 28
    pin.buildGeomFromUrdf(model, str(robot.urdf_path), pin.GeometryType.COLLISION)
    assert not read_urdf(robot.urdf_path.read_text()).note
    assert simulated_urdf(robot) is simulated_urdf(robot)


def test_a_link_that_is_no_sole_is_refused(tmp_path: Path) -> None:
    """G1's ankle is 35 mm above the floor: standing on it, the robot would sink in."""
    text = data_path("config/g1.yaml").read_text().replace("xyz: [0, 0, -0.035]", "xyz: [0, 0, 0]")
    (tmp_path / "g1.yaml").write_text(text)
    with pytest.raises(RobotConfigError, match=r"below left_sole .*-0\.035, .*frames"):
        simulated_urdf(load_robot_config(tmp_path / "g1.yaml"))


def test_talos_opens_the_papers_door(tmp_path: Path) -> None:
    """To 25 deg within 1 deg, held within 1.5 deg, and with 15 mm of margin."""
    run = rehearse(25.0, tmp_path / "log.npz", robot=RobotModel(load_robot_config("talos")),
                   engine="mujoco")
    angle = np.degrees(run.log.motion.door_angle)
    assert angle.max() == pytest.approx(25.0, abs=1.0)
    assert angle[-1] == pytest.approx(25.0, abs=1.5)
    margin = evaluation.support(run.log.motion, run.robot, window=evaluation.WINDOW).margin
    assert np.nanmin(margin) > 0.015
    assert run.log.stood

"""Robots that are not HRP-2 do the job by configuration alone."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from door_impact_view.scene.urdf import read_urdf
from door_model.door.config import load_door
from hrp2_description.data import data_path, share_folders
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.physics.shapes import simulated_urdf
from hrp2_sim_bridge.settings import ENGINES
from hrp2_sim_bridge.world import World
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.pinocchio_model import free_floating_model
from humanoid_motion.robot_model import RobotModel
from impact_planner.motion.missed import needed_reserve

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


@pytest.fixture(scope="module")
def talos() -> RobotModel:
    """The model of Talos with fixed fingers and head."""
    return RobotModel(load_robot_config("talos"))


def test_other_joints_are_fixed_and_meshes_found(talos: RobotModel) -> None:
    """Talos' URDF has 44 joints; 28 move in what every reader gets, and each mesh has a path.

    Its hulls are computed once, not at each reset of a world.
    """
    robot, model = talos.config, free_floating_model(talos.config)
    assert model.nv == 6 + 28
    assert talos.mass == pytest.approx(robot.mass) == pytest.approx(93.34, abs=0.01)
    pin.buildGeomFromUrdf(model, str(robot.urdf_path), pin.GeometryType.COLLISION)
    assert not read_urdf(robot.urdf_path.read_text()).note
    assert simulated_urdf(robot) is simulated_urdf(robot)


def test_a_link_that_is_no_sole_is_refused(tmp_path: Path) -> None:
    """G1's ankle is 35 mm above the floor: standing on it, the robot would sink in."""
    text = data_path("config/g1.yaml").read_text().replace("xyz: [0, 0, -0.035]", "xyz: [0, 0, 0]")
    (tmp_path / "g1.yaml").write_text(text)
    with pytest.raises(RobotConfigError, match=r"below left_sole .*-0\.035, .*frames"):
        simulated_urdf(load_robot_config(tmp_path / "g1.yaml"))


@pytest.fixture(scope="module")
def run(talos: RobotModel, tmp_path_factory: pytest.TempPathFactory) -> Rehearsal:
    """Its hit of the paper's door to 25 deg, from the nominal step."""
    return rehearse(
        25.0, tmp_path_factory.mktemp("talos") / "log.npz", robot=talos, engine="mujoco")


def test_talos_opens_the_papers_door(run: Rehearsal) -> None:
    """To 25 deg within 1 deg, held within 1.5 deg, and with 15 mm of margin."""
    angle = np.degrees(run.log.motion.door_angle)
    assert angle.max() == pytest.approx(25.0, abs=1.0)
    assert angle[-1] == pytest.approx(25.0, abs=1.5)
    margin = evaluation.support(run.log.motion, run.robot, window=evaluation.WINDOW).margin
    assert np.nanmin(margin) > 0.015
    assert run.log.stood


def test_the_plan_obeys_the_equations(run: Rehearsal, talos: RobotModel) -> None:
    """Eqs. (2) and (5) and restitution hold, and m_re is above eq. (3).

    It may exceed the mass by some 5 %: the servos of the legs push on during the contact.
    """
    plan = run.plan
    assert plan.warnings == ()
    assert plan.missed_margin > needed_reserve(talos.config)
    assert plan.effective_mass_planar < plan.effective_mass < 1.1 * talos.mass
    assert plan.required_impulse == pytest.approx(
        plan.effective_mass * (plan.v_rb - plan.v_rb_post))
    assert plan.omega_door * plan.l_b - plan.v_rb_post == pytest.approx(
        plan.apparent_restitution * plan.v_rb)
    assert plan.b_r == pytest.approx(plan.b_r_percussion, abs=1e-5)
    assert plan.hit.stance.step == pytest.approx(talos.config.step.nominal, abs=1e-4)


def test_the_hand_holds_the_leaf_at_the_target(run: Rehearsal, talos: RobotModel) -> None:
    """The hand touches the face, and elbow and wrist are clear of it."""
    plan, config = run.plan, talos.config
    q = talos.configuration(np.zeros(3), plan.phase("hold").knots.position[-1])
    shift = plan.left_foot - talos.frame_position(q, talos.feet["left"].frame)
    leaf = LeafFrame(plan.hit.placement.hinge, np.radians(25.0))
    hand = talos.frame_position(q, config.hand_link) + shift
    assert leaf.gap(hand) == pytest.approx(talos.hand_radius, abs=1e-3)
    lowest, highest = config.arm.heights
    assert lowest - 1e-6 <= hand[2] <= highest + 1e-6
    for link in (config.contact_link, config.arm.wrist_link):
        gap = leaf.gap(talos.frame_position(q, link) + shift)
        assert gap > config.contact_radius + 0.01, link

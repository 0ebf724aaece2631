"""The MuJoCo engine by itself: its model, contacts and sensors, without world and drives."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.contact import design_leaf
from hrp2_sim_bridge.physics.engine import Scene
from hrp2_sim_bridge.physics.kinematics import Kinematics
from hrp2_sim_bridge.physics.mujoco.engine import MuJoCoEngine
from hrp2_sim_bridge.settings import WorldSettings
from humanoid_motion.pinocchio_model import free_floating_model, joint_columns

NONE = np.zeros(30)
ALL = range(30)


@pytest.fixture
def make(robot, paper_door):
    """A function that makes an engine with a robot in a posture in front of the paper's door."""
    engines = []

    def build(posture=None, distance=0.9, config=robot, **settings):
        wanted = WorldSettings(**settings)
        scene = Scene(
            config, np.array(robot.half_sitting if posture is None else posture), paper_door,
            distance, -0.42, design_leaf(paper_door, -0.42, wanted), wanted)
        engines.append(MuJoCoEngine())
        engines[-1].reset(scene)
        return engines[-1]

    yield build
    for engine in engines:
        engine.close()


def lift(engine, height=5.0):
    """Put the robot into the air."""
    engine.data.qpos[2] += height


def base_of(engine):
    """Return the state of base_link, (1, 13)."""
    return engine.base_states(np.array([engine.read_base()]))


def links_of(engine, robot, *names):
    """Return the states of links."""
    return Kinematics(robot, names).states(base_of(engine), engine.joint_state()[None])[0].at(0)


def test_joints_accelerate_as_pinocchio_says(make, robot) -> None:
    """A floating robot in motion accelerates under torques exactly as its URDF's model does."""
    engine = make(robot.posture(robot.braced_posture))
    lift(engine)
    engine.data.qpos[3:7] = np.array([0.8, 0.2, -0.4, 0.4])
    random = np.random.default_rng(3)
    engine.data.qvel[:-1] = random.normal(0.0, 0.5, 36)
    model = free_floating_model(robot)
    places, joints = joint_columns(model, robot.joint_names)
    q, v, (base,) = pin.neutral(model), np.zeros(model.nv), base_of(engine)
    turn = pin.Quaternion(base[3:7]).matrix()
    q[:7] = base[:7]
    v[:3], v[3:6] = turn.T @ base[7:10], turn.T @ base[10:]
    q[places], v[joints] = engine.joint_state()
    torque = random.normal(0.0, 5.0, 30)
    forces = np.zeros(model.nv)
    forces[joints] = torque
    wanted = pin.aba(model, model.createData(), q, v, forces)[joints]
    engine.step(torque, 0.0)
    np.testing.assert_allclose(engine.data.qacc[6:-1], wanted, rtol=1e-6, atol=1e-6)


def test_nothing_slows_a_fall_or_a_leaf(make, paper_door) -> None:
    """A falling robot has the speed g t, and the leaf under a torque the speed M t / I."""
    engine = make()
    lift(engine)
    for _ in range(600):
        engine.step(NONE, 2.0)
    assert base_of(engine)[0, 9] == pytest.approx(-GRAVITY * 0.3, rel=1e-6)
    assert engine.door_state().velocity == pytest.approx(0.6 / paper_door.i_a, rel=1e-9)


def test_held_joints_bear_any_torque_and_let_go(make, robot) -> None:
    """Held joints stay to 10 urad under 500 N m; the one that is released moves at once."""
    engine = make()
    lift(engine)
    held = [robot.index(name) for name in robot.braced_joints]
    torque = np.zeros(30)
    torque[held[1]] = 500.0
    engine.hold(held)
    before = engine.joint_state()[0]
    for _ in range(800):
        engine.step(torque, 0.0)
        engine.hold(held)
    assert np.abs(engine.joint_state()[0] - before)[held].max() < 1e-5
    engine.hold([])
    for _ in range(20):
        engine.step(torque, 0.0)
    assert np.abs(engine.joint_state()[0] - before)[held[1]] > 0.01


def test_distance_to_the_leaf_is_that_of_the_elbow(make, robot) -> None:
    """The distance is the elbow's, and at most what is asked for."""
    engine = make(robot.posture(robot.braced_posture), distance=0.5)
    gap = links_of(engine, robot, robot.contact_link).position[0, 1] - robot.contact_radius + 0.5
    assert engine.leaf_distance(0.5) == pytest.approx(gap, abs=1e-6)
    assert engine.leaf_distance(0.5 * gap) == 0.5 * gap


def test_a_robot_that_lies_is_reported_by_its_links(make) -> None:
    """The links of a lying robot that meet the floor are reported, and its tilt."""
    engine = make()
    engine.data.qpos[:7] = [0.0, 0.0, 0.6, np.cos(0.7), 0.0, np.sin(0.7), 0.0]
    engine.hold(ALL)
    links = set()
    for _ in range(1200):
        engine.step(NONE, 0.0)
        contacts = engine.floor_contacts()
        links |= {contact.link for contact in contacts if contact.distance <= 0.0}
    assert pin.Quaternion(base_of(engine)[0, 3:7]).matrix()[2, 2] < 0.5
    assert links & {"torso", "HEAD_LINK1", "base_link"}


def test_a_robot_that_mujoco_refuses_is_an_error_that_names_it(make, robot, tmp_path) -> None:
    """An inertia that no body can have is refused."""
    broken = tmp_path / "broken.urdf"
    text = robot.urdf_path.read_text(encoding="utf-8")
    broken.write_text(text.replace('ixx="0.002327"', 'ixx="2.327"'), encoding="utf-8")
    with pytest.raises(ModelError, match=robot.name):
        make(config=replace(robot, urdf_path=broken))

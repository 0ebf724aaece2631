"""The MuJoCo engine by itself: its model, contacts and sensors, without world and drives."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.benches.pull_bench import pull_test
from hrp2_sim_bridge.errors import DivergedError, ModelError
from hrp2_sim_bridge.physics.contact import design_leaf
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.physics.mujoco.engine import MuJoCoEngine
from hrp2_sim_bridge.physics.scene import Scene
from hrp2_sim_bridge.sensors.wrench import outer_wrenches
from hrp2_sim_bridge.settings import WorldSettings
from humanoid_motion.robot_model import RobotModel

pytest.importorskip("mujoco")
STEP = WorldSettings.time_step_coarse
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


def reference_model(robot, engine):
    """Return Pinocchio's model, its data, and the engine's state as its q (37) and v (36)."""
    model = pin.buildModelFromUrdf(str(robot.urdf_path), pin.JointModelFreeFlyer())
    joints = [model.joints[model.getJointId(name)] for name in robot.joint_names]
    q, v = pin.neutral(model), np.zeros(model.nv)
    base = engine.base_states(np.array([engine.read_frames()])).at(0)
    turn = rotation(base.quaternion)
    q[:7] = [*base.position, *base.quaternion]
    v[:6] = [*turn.T @ base.linear, *turn.T @ base.angular]
    place, speed = [joint.idx_q for joint in joints], [joint.idx_v for joint in joints]
    q[place], v[speed] = engine.joint_state()
    return model, model.createData(), q, v, speed


def stand(engine, seconds, step=STEP):
    """Let a robot whose joints are held stand; return soles at the ends and mean wrenches."""
    engine.hold(ALL)
    begin = engine.read_frames()
    count = round(seconds / step)
    reactions = np.mean([engine.step(NONE, 0.0) for _ in range(count)], axis=0)
    rows = np.array([begin, engine.read_frames()])
    soles = engine.link_states(rows).at((slice(None), slice(2)))
    wrenches = outer_wrenches(
        reactions[None, :2], soles, seconds, engine.sensed_mass[:2], engine.sensed_inertia[:2])
    return soles, wrenches[0]


def test_joints_accelerate_as_pinocchio_says(make, robot) -> None:
    """A floating robot in motion accelerates under torques exactly as its URDF's model does."""
    engine = make(robot.posture(robot.braced_posture))
    lift(engine)
    engine.data.qpos[3:7] = np.array([0.8, 0.2, -0.4, 0.4])
    random = np.random.default_rng(3)
    engine.data.qvel[:-1] = random.normal(0.0, 0.5, 36)
    engine._moved = True
    model, data, q, v, joints = reference_model(robot, engine)
    torque = random.normal(0.0, 5.0, 30)
    forces = np.zeros(model.nv)
    forces[joints] = torque
    wanted = pin.aba(model, data, q, v, forces)[joints]
    engine.step(torque, 0.0)
    np.testing.assert_allclose(engine.data.qacc[6:-1], wanted, rtol=1e-6, atol=1e-6)


def test_frames_are_those_of_base_and_joints(make, robot) -> None:
    """Poses and velocities of soles, elbow and IMU agree with base and joints of that instant."""
    engine = make()
    lift(engine)
    random = np.random.default_rng(4)
    engine.read_frames()
    for _ in range(200):
        engine.step(0.2 * random.normal(size=30), 0.0)
    model, data, q, v, _ = reference_model(robot, engine)
    pin.forwardKinematics(model, data, q, v)
    pin.updateFramePlacements(model, data)
    states = engine.link_states(np.array([engine.read_frames()]))
    assert np.abs(states.linear).max() > 0.1
    names = (robot.feet["left"].sole, robot.feet["right"].sole, robot.contact_link,
             robot.imu_frame)
    for index, name in enumerate(names):
        frame = model.getFrameId(name)
        speed = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        state = states.at((0, index))
        np.testing.assert_allclose(state.position, data.oMf[frame].translation, atol=1e-9)
        np.testing.assert_allclose(
            rotation(state.quaternion), data.oMf[frame].rotation, atol=1e-9)
        np.testing.assert_allclose(state.linear, speed.linear, atol=1e-9)
        np.testing.assert_allclose(state.angular, speed.angular, atol=1e-9)


def test_nothing_slows_a_fall_or_a_leaf(make, paper_door) -> None:
    """A falling robot has the speed g t, and the leaf under a torque the speed M t / I."""
    engine = make()
    lift(engine)
    for _ in range(600):
        engine.step(NONE, 2.0)
    base = engine.base_states(np.array([engine.read_frames()])).at(0)
    assert base.linear[2] == pytest.approx(-GRAVITY * 0.3, rel=1e-6)
    assert engine.door_state().velocity == pytest.approx(0.6 / paper_door.i_a, rel=1e-9)


@pytest.mark.parametrize("sole", ["rubber", "rigid"])
def test_soles_carry_the_weight_and_do_not_creep(make, robot, sole) -> None:
    """The sensors read m g to 0.5 %, and the soles stay in place to a micrometre a second."""
    engine = make(sole=sole)
    stand(engine, 1.0)
    soles, wrenches = stand(engine, 1.0)
    assert wrenches[:, 2].sum() == pytest.approx(robot.mass * GRAVITY, rel=0.005)
    assert np.abs(wrenches[:, :2].sum(axis=0)).max() < 0.01 * robot.mass * GRAVITY
    assert np.abs(np.diff(soles.position[..., :2], axis=0)).max() < 3e-6
    soles, wrenches = stand(engine, STEP)
    contacts = engine.floor_contacts()
    assert {contact.link for contact in contacts} == {"l_sole", "r_sole"}
    assert len(contacts) == 8
    # The sum over the floor's contacts is the sensors' sum, about the world's origin as well.
    force = sum(np.array(contact.force) for contact in contacts)
    assert force[2] == pytest.approx(wrenches[:, 2].sum(), rel=1e-3)
    moment = sum(np.cross(contact.point, contact.force) for contact in contacts)
    measured = sum(
        wrench[3:] + np.cross(soles.position[-1, side], wrench[:3])
        for side, wrench in enumerate(wrenches))
    np.testing.assert_allclose(measured[:2], moment[:2], atol=1e-3 * force[2])  # a millimetre


def test_rubber_sags_by_weight_over_stiffness_at_any_step(make, robot) -> None:
    """The soles sag by m g / 2 k on average; a change of the step does not move them."""
    engine = make(sole="rubber")
    stand(engine, 1.0)
    engine.set_time_step(0.00025)
    soles, _ = stand(engine, 1.0, 0.00025)
    middle = soles.position[-1] + rotation(soles.quaternion[-1]) @ np.array([0.015, 0.0, 0.0])
    sag = robot.mass * GRAVITY / 2.0 / robot.sole_rubber.stiffness
    assert -middle[:, 2].mean() == pytest.approx(sag, rel=0.01)


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


@pytest.mark.parametrize("braced", [True, False])
def test_held_robot_shows_the_effective_mass_of_its_mass_matrix(robot, braced) -> None:
    """With held joints and fixed soles a short force moves point B as 1 / (J M^-1 J^T) says."""
    posture = robot.posture(robot.braced_posture)
    locked = robot.braced_joints if braced else ()
    model = RobotModel(robot)
    exact = model.effective_mass(
        model.configuration(np.zeros(3), posture), locked=locked, rotors=0.0)
    pulled = pull_test(robot, posture, locked=locked, engine="mujoco")
    assert pulled.effective_mass == pytest.approx(exact, rel=1e-3)


def test_a_hit_gives_the_leaf_its_impulse_and_the_robot_the_opposite(
    make, robot, paper_door
) -> None:
    """The leaf gains the moment of the elbow's forces, and the robot loses their impulse."""
    engine = make(robot.posture(robot.braced_posture), distance=0.5, sole="rubber")
    lift(engine)
    place = engine.link_states(np.array([engine.read_frames()])).at((0, 2)).position
    engine.data.qpos[:3] += [-place[0], -0.5 + robot.contact_radius + 1e-4 - place[1],
                             1.7 - place[2]]
    engine.data.qvel[1] = -0.4
    engine.model.opt.gravity[2] = 0.0
    engine.hold(ALL)
    engine.set_time_step(0.00025)
    before = robot.mass * engine.data.qvel[1]
    links, moment, impulse = set(), 0.0, 0.0
    for _ in range(120):
        engine.step(NONE, 0.0)
        touch = engine.touch()
        if touch.force > 0.0:
            links.add(engine.link_names[touch.link])
            moment += touch.force * (touch.point[0] + 0.42) * 0.00025
            impulse += touch.force * 0.00025
    assert links == {robot.contact_link}
    assert engine.touch().force == 0.0
    assert paper_door.i_a * engine.door_state().velocity == pytest.approx(moment, rel=1e-3)
    model, data, q, v, _ = reference_model(robot, engine)
    pin.centerOfMass(model, data, q, v)
    assert robot.mass * data.vcom[0][1] - before == pytest.approx(impulse, rel=5e-3)


def test_distance_to_the_leaf_is_that_of_the_elbow(make, robot) -> None:
    """The distance is the elbow's, and at most what is asked for."""
    engine = make(robot.posture(robot.braced_posture), distance=0.5)
    elbow = engine.link_states(np.array([engine.read_frames()])).at((0, 2)).position
    gap = elbow[1] - robot.contact_radius + 0.5
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
    assert engine.tilt() > 1.0
    assert links & {"torso", "HEAD_LINK1", "base_link"}


def test_reset_brings_back_the_same_run_bit_for_bit(make, robot, paper_door) -> None:
    """After each reset the same torques make the same run, with holds and a change of the step."""
    runs = []
    settings = WorldSettings()
    scene = Scene(
        robot, np.array(robot.half_sitting), paper_door, 0.45, -0.42,
        design_leaf(paper_door, -0.42, settings), settings)
    engine = make()
    for _ in range(2):
        engine.reset(scene)
        random = np.random.default_rng(5)
        rows = []
        for step in range(300):
            engine.hold(ALL if step < 200 else range(20))
            if step == 100:
                engine.set_time_step(0.00025)
            reaction = engine.step(random.normal(size=30), 20.0)
            rows.append([*engine.read_frames(), *np.ravel(reaction), *engine.door_state()])
        runs.append(rows)
    np.testing.assert_array_equal(runs[0], runs[1])


def test_a_simulation_that_diverges_says_so(make) -> None:
    """A state that is no number is an error instead of a robot that stands as at the start."""
    engine = make()
    for _ in range(20):
        engine.step(np.full(30, 1e9), 0.0)
    with pytest.raises(DivergedError, match="diverged"):
        engine.read_frames()


def test_a_robot_that_mujoco_refuses_is_an_error_that_names_it(make, robot, tmp_path) -> None:
    """An inertia that no body can have is refused."""
    broken = tmp_path / "broken.urdf"
    text = robot.urdf_path.read_text(encoding="utf-8")
    broken.write_text(text.replace('ixx="0.002327"', 'ixx="2.327"'), encoding="utf-8")
    with pytest.raises(ModelError, match=robot.name):
        make(config=replace(robot, urdf_path=broken))

"""The interface between the world and a physics engine."""

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.errors import DivergedError
from hrp2_sim_bridge.physics.engine import NO_TOUCH, DoorState, Engine
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.physics.kinematics import Kinematics
from hrp2_sim_bridge.settings import ENGINES
from hrp2_sim_bridge.world import World


class StillEngine(Engine):
    """An engine in which each joint is a free body of 1 kg m^2 and nothing else moves."""

    name = "pybullet"  # for which it stands in
    link_names = ("l_sole", "r_sole")
    stepping_time = 0.0

    def __init__(self) -> None:
        self.closed, self.steps, self.step_length, self.door_torques = False, [], None, []

    def reset(self, scene) -> None:
        self.joints = np.array([scene.posture, np.zeros(30)])
        self.step_length = scene.settings.time_step_coarse
        self.half_weight = scene.robot.mass * GRAVITY / 2.0

    def set_time_step(self, step) -> None:
        self.step_length = step

    def step(self, torque, door_torque):
        self.joints[1] += self.step_length * torque
        self.joints[0] += self.step_length * self.joints[1]
        self.steps.append(self.step_length)
        self.door_torques.append(door_torque)
        # Of the ankles on the soles, which add their own weight.
        force = -(self.half_weight - 0.2 * GRAVITY)
        return [(0.0, 0.0, force, 0.0, 0.0, 0.0)] * 4

    def joint_state(self):
        return self.joints.copy()

    def read_base(self):
        return [0.0] * 6 + [1.0] + [0.0] * 6

    def base_states(self, rows):
        return rows

    def door_state(self):
        return DoorState(0.0, 0.0)

    def leaf_distance(self, most) -> float:
        return most

    def touch(self):
        return NO_TOUCH

    def frame_force(self):
        return 0.0

    def floor_contacts(self):
        return []

    def close(self) -> None:
        self.closed = True


def tick(world):
    """Return the number of the tick."""
    return round(world.time / 0.005)


@pytest.mark.parametrize("sole", ["rigid", "rubber"])
def test_a_world_steps_any_engine_that_has_the_interface(robot, paper_door, moving, sole) -> None:
    """With any engine the joints follow, the feet carry the weight, and the log is complete."""
    engine = StillEngine()
    world = World(robot, paper_door, 0.9, -0.42, engine=engine, sole=sole, stabilizer=False)
    observed = []
    world.observers.append(observed.append)
    steps = len(engine.steps)
    target = robot.posture({"LARM_JOINT4": -0.5})
    world.follow(moving(np.array([0.05, 0.5]), np.array([robot.half_sitting, target])), 0.0)
    samples = [world.step() for _ in range(110)]
    np.testing.assert_allclose(samples[-1].position, target, atol=0.02)
    carried = samples[-1].left_wrench[2] + samples[-1].right_wrench[2]
    assert carried == pytest.approx(robot.mass * GRAVITY, rel=0.01)
    assert len(engine.steps) - steps == len(observed) == 110 * 10
    assert set(engine.steps) == {world.settings.time_step_coarse}
    assert engine.door_torques[-1] == pytest.approx(-paper_door.door().restoring_torque(0.0))
    log = world.log()
    assert len(log["time"]) == 550
    assert not world.fell
    world.close()
    assert engine.closed


def test_steps_are_fine_in_just_those_ticks_in_which_the_leaf_is_near(robot, paper_door) -> None:
    """At any distance that changes by up to 4 m/s; it is asked for only where it could matter."""
    gaps = 0.2 + np.cumsum(np.repeat([-0.004, 0.0, 0.019, -0.019, 0.0], [50, 30, 30, 30, 10]))
    engine = StillEngine()
    world = World(robot, paper_door, 0.9, -0.42, engine=engine, sole="rigid")
    asked = []

    def distance(most):
        asked.append(tick(world))
        return min(most, float(gaps[tick(world)]))

    engine.leaf_distance = distance
    for _ in gaps:
        world.step()
    near = gaps < 0.08
    assert 0.2 < near.mean() < 0.8
    np.testing.assert_array_equal(world.log()["tick_fine"], near)
    assert len(asked) < 0.6 * len(gaps)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_simulation_that_diverges_says_so_in_any_engine(robot, paper_door, engine) -> None:
    """A step with a motor at an angle of NaN raises DivergedError, with pads and without."""
    for brace in ("contact", "none"):
        world = World(robot, paper_door, 2.0, -0.42, engine=engine, sole="rigid", brace=brace)
        world.joints.drives.position[:] = np.nan
        with pytest.raises(DivergedError, match="diverged"):
            world.step()
        world.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_the_states_of_links_are_the_engines_own(make_world, robot, moving, engine) -> None:
    """Poses and velocities that follow from base and joints agree with it in a quick motion."""
    world = make_world(engine=engine)
    swung = robot.posture({"RARM_JOINT0": -1.2, "RARM_JOINT3": -1.2})
    world.follow(moving(np.array([0.05, 0.7]), np.array([robot.half_sitting, swung])), 0.0)
    for _ in range(70):
        world.step()
    links = [robot.contact_link, robot.imu_frame, robot.feet["left"].sole]
    base = world.engine.base_states(np.array([world.engine.read_base()]))
    found = Kinematics(robot, links).states(base, world.joints.state[None])[0].at(0)
    assert np.linalg.norm(found.linear[0]) > 0.5
    for index, link in enumerate(links):
        place, turn, speed, rate = own_state(world.engine, link)
        np.testing.assert_allclose(found.position[index], place, atol=1e-8)
        np.testing.assert_allclose(found.turn[index], turn, atol=1e-8)
        np.testing.assert_allclose(found.linear[index], speed, atol=1e-7)
        np.testing.assert_allclose(found.angular[index], rate, atol=1e-7)


def own_state(engine, link):
    """Return place, rotation matrix, velocity and angular velocity of a link in an engine."""
    if engine.name == "pybullet":
        state = engine.client.getLinkState(engine.body, engine.link_names.index(link), 1, 1)
        com, place, turn, speed, rate = (np.array(state[i]) for i in (0, 4, 5, 6, 7))
        return place, rotation(turn), speed + np.cross(rate, place - com), rate
    mujoco, model, data = pytest.importorskip("mujoco"), engine.model, engine.data
    mujoco.mj_forward(model, data)
    body, twist = model.body(link).id, np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
    return data.xpos[body], data.xmat[body].reshape(3, 3), twist[3:], twist[:3]

"""The interface between the world and a physics engine."""

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_sim_bridge.errors import DivergedError
from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.states import NO_TOUCH, BodyState, DoorState
from hrp2_sim_bridge.settings import ENGINES
from hrp2_sim_bridge.world import World


class StillEngine(Engine):
    """An engine in which each joint is a free body of 1 kg m^2 and nothing else moves."""

    name = "pybullet"  # for which it stands in
    link_names = ("l_sole", "r_sole")
    sensed_mass = np.ones(2)
    sensed_inertia = np.ones((2, 3))
    frame_values = 1
    stepping_time = 0.0

    def __init__(self) -> None:
        self.closed, self.steps, self.step_length, self.door_torques = False, [], None, []

    def reset(self, scene) -> None:
        self.joints = np.array([scene.posture, np.zeros(30)])
        self.step_length = scene.settings.time_step_coarse
        self.half_weight = scene.robot.mass * GRAVITY / 2.0

    def set_time_step(self, step) -> None:
        self.step_length = step

    def hold(self, joints) -> None:
        self.held = list(joints)

    def push_robot(self, force) -> None:
        self.push = force

    def step(self, torque, door_torque):
        self.joints[1] += self.step_length * torque
        self.joints[0] += self.step_length * self.joints[1]
        self.steps.append(self.step_length)
        self.door_torques.append(door_torque)
        # Of the ankles on the soles, which add their own weight.
        force = -(self.half_weight - self.sensed_mass[0] * GRAVITY)
        return [(0.0, 0.0, force, 0.0, 0.0, 0.0)] * 2

    def joint_state(self):
        return self.joints.copy()

    def read_frames(self):
        return [0.0]

    def _states(self, *shape):
        turn = np.tile([0.0, 0.0, 0.0, 1.0], (*shape, 1))
        return BodyState(np.zeros((*shape, 3)), turn, np.zeros((*shape, 3)), np.zeros((*shape, 3)))

    def link_states(self, rows):
        return self._states(len(rows), 4)

    def hand_states(self):
        return self._states(0)

    def base_states(self, rows):
        return self._states(len(rows))

    def tilt(self) -> float:
        return 0.0

    def door_state(self):
        return DoorState(0.0, 0.0)

    def leaf_distance(self, most) -> float:
        return most

    def touch(self):
        return NO_TOUCH

    def floor_contacts(self):
        return []

    def close(self) -> None:
        self.closed = True


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


def test_a_world_chooses_fine_steps_near_the_leaf_in_any_engine(robot, paper_door) -> None:
    """The world sets fine steps where the engine reports a small distance."""
    engine = StillEngine()
    engine.leaf_distance = lambda most: 0.01
    world = World(robot, paper_door, 0.9, -0.42, engine=engine, sole="rigid")
    assert engine.steps[-1] == world.time_step == world.settings.time_step_fine
    assert world.wall_time > 0.0


def test_steps_are_fine_in_just_those_ticks_in_which_the_leaf_is_near(robot, paper_door) -> None:
    """At any distance that changes by up to 4 m/s; it is asked for only where it could matter."""
    gaps = 0.2 + np.cumsum(np.repeat([-0.004, 0.0, 0.019, -0.019, 0.0], [50, 30, 30, 30, 10]))
    engine = StillEngine()
    world = World(robot, paper_door, 0.9, -0.42, engine=engine, sole="rigid")
    asked = []

    def distance(most):
        asked.append(world.tick)
        return min(most, float(gaps[world.tick]))

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

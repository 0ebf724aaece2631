"""Hands that yield, in the simulated world, in each physics engine."""

from dataclasses import replace

import numpy as np
import pytest
from hrp2_sim_bridge.settings import ENGINES, TICK
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel

EACH_ENGINE = pytest.mark.parametrize("engine", ENGINES)
GAP = 0.003  # between hand and leaf at the start [m]
PUSH = np.radians(12.0)  # of the shoulder against the leaf


@pytest.fixture
def at_the_leaf(robot, paper_door, moving):
    """A function for a world whose robot begins to press on the closed leaf with its right hand.

    The inertia of the leaf is a multiple of the paper's door.
    """
    posture = robot.posture({
        f"RARM_JOINT{joint}": np.radians(angle) for joint, angle in ((0, -20), (1, -50), (3, -50))})
    model = RobotModel(robot)
    x, y, _ = model.poses_in_base(posture, [robot.hand_link])[0][:3, 3]
    there = posture.copy()
    there[robot.index("RARM_JOINT1")] -= PUSH
    worlds = []

    def make(engine, inertia, *order):
        door = replace(paper_door, i_a=paper_door.i_a * inertia)
        world = World(
            robot, door, GAP + model.hand_radius - y, x - 0.6, posture=posture, engine=engine)
        worlds.append(world)
        world.comply("right", *order)
        world.follow(moving(np.array([0.0, 0.6]), np.array([posture, there])), 0.0)
        return world

    yield make
    for world in worlds:
        world.close()


def forces(world, ticks):
    """Return what the right wrist measures, (ticks,) [N]."""
    return np.array([np.linalg.norm(world.step().right_hand_wrench[:3]) for _ in range(ticks)])


def pull_hand(world, force, begin, end):
    """Push the middle of the right hand with a force in the world between two times [N, s]."""
    link = world.robot_config.wrist_sensors["right"].link

    def pull(engine):
        now = np.array(force) if begin < world.time < end else np.zeros(3)
        if engine.name == "mujoco":
            engine.data.xfrc_applied[engine.model.body(link).id, :3] = now
        elif now.any():
            index = engine.link_names.index(link)
            place = engine.client.getLinkState(engine.body, index)[0]
            engine.client.applyExternalForce(
                engine.body, index, now, place, engine.client.WORLD_FRAME)

    world.observers.append(pull)


@pytest.mark.nightly("five seconds of simulated time each")
@EACH_ENGINE
def test_at_a_wall_a_yielding_hand_presses_gently_and_nothing_grows(at_the_leaf, engine) -> None:
    """At a leaf of 1000 times the inertia the force is that of the spring, and it settles."""
    assert forces(at_the_leaf(engine, 1000.0), 200).max() > 60.0
    felt = forces(at_the_leaf(engine, 1000.0, 200.0), 600)
    assert felt.max() < 40.0
    assert felt[500:].std() < 1.5
    # The commanded place is 62 mm behind the face.
    assert felt[500:].mean() == pytest.approx(200.0 * 0.062, rel=0.3)


@pytest.mark.nightly("four seconds of simulated time each")
@EACH_ENGINE
def test_switching_in_contact_does_not_throw_the_leaf(at_the_leaf, engine) -> None:
    """Yielding, harder, stiff and yielding again at an open leaf stay below 60 N, always at it."""
    world = at_the_leaf(engine, 1.0)
    forces(world, 300)
    opened = world.door_state.angle
    assert opened > np.radians(3.0)
    for order in ((200.0,), (800.0, 400.0, 10.0), (), (200.0,)):
        world.comply("right", *order)
        assert forces(world, 120).max() < 60.0
    assert not world.fell
    assert 0.0 < world.door_state.angle < 2.0 * opened


@pytest.mark.nightly("three seconds of simulated time each")
@EACH_ENGINE
def test_200_newtons_on_a_yielding_hand_do_not_throw_the_robot(make_world, engine) -> None:
    """For 0.1 s, from the side: the displacement saturates, and the robot stands as before."""
    world = make_world(engine=engine)
    world.comply("right", 200.0)
    pull_hand(world, (0.0, 200.0, 0.0), 0.1, 0.2)
    far = []
    for _ in range(500):
        world.step()
        far.append(np.linalg.norm(world.hands.displacement("right")))
    assert 0.02 < max(far) <= 0.12 + 1e-9
    assert far[-1] < 0.01
    assert world.engine.base_states(np.array([world.engine.read_base()]))[0, 6] > 0.9999


@EACH_ENGINE
def test_the_balance_knows_the_force_on_a_yielding_hand(make_world, engine) -> None:
    """Under 25 N from ahead on a hand that yields by 12 mm the robot leans half as far or less."""
    tilts = []
    for order in ((), (2000.0, 1000.0)):
        world = make_world(engine=engine)
        world.comply("right", *order)
        pull_hand(world, (-25.0, 0.0, 0.0), 0.1, np.inf)
        for _ in range(round(1.0 / TICK)):
            world.step()
        tilts.append(np.degrees(world.fall.max_tilt))
    stiff, yielding = tilts
    assert stiff > 0.7
    assert yielding < 0.5


def test_a_reset_makes_the_hands_stiff_and_a_stop_does_not(make_world) -> None:
    """After a reset a run is the same, bit for bit, as before the hand yielded."""
    world = make_world(engine="mujoco")
    runs = []
    for order in ((), (200.0,), ()):
        world.comply("right", *order)
        world.stop()
        pull_hand(world, (-25.0, 0.0, 0.0), 0.05, np.inf)
        for _ in range(60):
            world.step()
        runs.append(world.log())
        assert world.hands.active == bool(order)
        world.observers.clear()
        world.reset()
    for name in ("q", "left_wrench", "base_position"):
        np.testing.assert_array_equal(runs[0][name], runs[2][name], err_msg=name)
        assert not np.array_equal(runs[0][name], runs[1][name])

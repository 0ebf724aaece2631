"""The force sensors of the wrists in the simulated world, in each physics engine."""

from dataclasses import replace

import numpy as np
import pytest
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import ENGINES, SensorSettings
from hrp2_sim_bridge.world import World

EXACT = SensorSettings(sensor_noise=False)


@pytest.fixture(autouse=True)
def installed() -> None:
    """Skip these tests where an engine is not installed."""
    for engine in ENGINES:
        pytest.importorskip(engine)


def hands_of(sample):
    """Return the wrenches of the left and the right hand, (2, 6)."""
    return np.array([sample.left_hand_wrench, sample.right_hand_wrench])


def push_hand(world, side, force):
    """Push the middle of a hand with a force in the world from the next step on [N]."""
    link = world.robot_config.wrist_sensors[side].link
    if world.engine.name == "mujoco":
        world.engine.data.xfrc_applied[world.engine.model.body(link).id, :3] = force
        return

    def push(engine):
        index = engine.link_names.index(link)
        place = engine.client.getLinkState(engine.robot.body, index)[0]
        engine.client.applyExternalForce(
            engine.robot.body, index, force, place, engine.client.WORLD_FRAME)

    world.observers.append(push)


def test_hands_in_the_air_feel_nothing(make_world, sway, moving) -> None:
    """Their own weight and inertia are compensated, at rest and in motion: below 0.1 N."""
    world = make_world(sensors=EXACT)
    path = np.array([sway(y) for y in (0.0, 0.04, -0.04, 0.0)])
    world.follow(moving(np.array([0.1, 0.5, 0.9, 1.3]), path), 0.0)
    felt = np.array([hands_of(world.step()) for _ in range(250)])
    assert np.abs(felt[..., :3]).max() < 0.1
    assert np.abs(felt[..., 3:]).max() < 0.01


@pytest.mark.parametrize(("engine", "side"), [*zip(ENGINES, SIDES, strict=True)])
def test_a_hand_feels_the_force_on_it_in_its_own_axes(make_world, engine, side) -> None:
    """To 1 %, wherever the hand points; the other hand feels nothing."""
    world = make_world(engine=engine, sensors=EXACT)
    force = np.array([4.0, -6.0, 8.0])
    push_hand(world, side, force)
    for _ in range(120):
        felt = hands_of(world.step())
    place = SIDES.index(side)
    turn = rotation(world.engine.hand_states().quaternion[place])
    assert np.abs(turn - np.eye(3)).max() > 0.2
    np.testing.assert_allclose(turn @ felt[place, :3], force, atol=0.1)
    assert np.abs(felt[place, 3:]).max() < 0.01
    assert np.abs(felt[1 - place]).max() < 0.1


def test_a_robot_without_wrist_sensors_measures_as_before(robot, paper_door, make_world) -> None:
    """It has no readings of its hands, and every other reading is the same, bit for bit."""
    bare = World(replace(robot, wrist_sensors=None), paper_door, 0.9, -0.42, sole="rigid")
    with_sensors = make_world(sole="rigid")
    for _ in range(10):
        one, other = bare.step(), with_sensors.step()
        assert one.left_hand_wrench is None
        assert one.right_hand_wrench is None
        for name in ("left_wrench", "right_wrench", "position", "effort"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        np.testing.assert_array_equal(one.imu.orientation, other.imu.orientation)
    bare.close()

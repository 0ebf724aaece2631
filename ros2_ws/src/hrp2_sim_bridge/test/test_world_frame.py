"""The door's frame and the wall around it: what the robot meets in each engine."""

from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_model.door.geometry import Frame
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import ENGINES, SensorSettings
from hrp2_sim_bridge.world import World

DISTANCE, HINGE_X = 0.9, -0.42
EXACT = SensorSettings(sensor_noise=False)
EACH_ENGINE = pytest.mark.parametrize("engine", ENGINES)


@pytest.fixture
def framed(robot, paper_door):
    """A function that makes worlds with the paper's leaf in a frame; they are closed afterwards."""
    worlds = []

    def make(frame=paper_door.frame, distance=DISTANCE, **settings):
        door = replace(paper_door, frame=frame)
        worlds.append(World(robot, door, distance, HINGE_X, sensors=EXACT, **settings))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()


def run(world, seconds):
    """Step for a number of seconds; return the log."""
    for _ in range(round(seconds / 0.005)):
        world.step()
    return world.log()


def foot_forces(log):
    """Return the force of the floor on both feet in the world, (T, 3) [N]."""
    return sum(
        (rotation(log[f"{side}_sole_quaternion"]) @ log[f"{side}_wrench"][:, :3, None])[..., 0]
        for side in SIDES)


@EACH_ENGINE
def test_a_frame_that_nothing_touches_changes_nothing(framed, engine) -> None:
    """With and without it the run is the same, bit for bit, also while the leaf swings wide."""
    logs = []
    for frame in (Frame(0.9, 0.1, 0.14), None):
        world = framed(frame, engine=engine)
        world.push_door(60.0, 0.1)
        logs.append(run(world, 0.5))
    assert logs[0]["door_angle"].max() > np.radians(85.0)
    for name, column in logs[0].items():
        np.testing.assert_array_equal(column, logs[1][name], err_msg=name)
    assert logs[0]["frame_force"].max() == 0.0


@EACH_ENGINE
def test_the_log_has_the_force_of_the_wall(framed, robot, engine) -> None:
    """Pushed sideways against the wall, the robot gets the momentum that the log's forces say."""
    world = framed(engine=engine, start=(1.2, -0.8 + 0.42, 0.0))
    world.push_robot(np.array([0.0, -60.0, 0.0]), 0.1)
    log = run(world, 0.2)
    force = log["frame_force"]
    touched = np.flatnonzero(force > 0.0)
    assert force.max() > 50.0
    assert log["contact_force"].max() == 0.0
    # The wall's face has the normal y; friction acts along it.
    push = np.where(log["time"] <= 0.1 + 1e-9, -600.0, 0.0)
    impulse = np.cumsum(foot_forces(log)[1:, 1] + force[1:] + push[1:]) * 0.001
    momentum = robot.mass * (log["com_velocity"][1:, 1] - log["com_velocity"][0, 1])
    until = touched[0] + 100
    assert force[:until].sum() * 0.001 > 5.0
    np.testing.assert_allclose(momentum[:until], impulse[:until], atol=0.5)


@EACH_ENGINE
def test_feet_on_a_threshold_feel_it(framed, robot, engine) -> None:
    """Soles on a threshold carry the weight there: it is a floor, not a contact with the frame."""
    deep = Frame(0.9, 1.1, 1.2, 0.004)  # which the robot stands on from the first
    world = framed(deep, 0.6, engine=engine)
    log = run(world, 1.0)
    assert not world.fell
    np.testing.assert_allclose(foot_forces(log)[-500:, 2], robot.mass * GRAVITY, rtol=0.01)
    sag = robot.mass * GRAVITY / 2.0 / robot.sole_rubber.stiffness
    heights = [log[f"{side}_sole_position"][-1, 2] for side in SIDES]
    assert np.mean(heights) == pytest.approx(0.004 - sag, abs=2e-4)
    contacts = world.engine.floor_contacts()
    assert {contact.link for contact in contacts if contact.force[2] > 0.0} == {"l_sole", "r_sole"}
    carried = sum(contact.force[2] for contact in contacts)
    assert carried == pytest.approx(robot.mass * GRAVITY, rel=0.01)
    assert log["frame_force"].max() == 0.0

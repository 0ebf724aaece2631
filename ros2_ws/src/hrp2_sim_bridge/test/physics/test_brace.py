import dataclasses

import numpy as np
import pytest
from hrp2_sim_bridge.physics.brace import BracePads
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel
from hypothesis import given
from hypothesis import strategies as st

STEP = 2.5e-4
STILL = np.zeros(30)
SMALL = st.floats(-0.02, 0.02)
ARM = [f"RARM_JOINT{joint}" for joint in range(4)]


@pytest.fixture(scope="module")
def braced(robot):
    return robot.posture(robot.braced_posture)


def pads_of(robot, **changes):
    return BracePads(robot, dataclasses.replace(robot.brace, **changes))


def moved(robot, braced, angles):
    posture = np.array(braced)
    posture[[robot.index(name) for name in ARM]] += angles
    return posture


def distance(robot, posture):
    """Return how far the arm's ball is from the disc's plane, by the robot's kinematics [m]."""
    model, brace = RobotModel(robot), robot.brace
    q = model.configuration(np.zeros(3), posture)
    places = []
    for pad in (brace.arm, brace.trunk):
        origin, turn = model.frame_pose(q, pad.link)
        places.append(origin + turn @ np.array(pad.place))
    _, trunk = model.frame_pose(q, brace.trunk.link)
    return float(trunk @ np.array(brace.normal) @ (places[0] - places[1])) - brace.arm.size


def test_the_braced_posture_presses_the_pads_by_a_little(robot, braced) -> None:
    """The ball of the braced arm is 0.5 to 3 mm inside the trunk's pad."""
    assert -3e-3 < distance(robot, braced) < -5e-4


@given(st.lists(SMALL, min_size=4, max_size=4))
def test_the_normal_force_is_the_stiffness_times_the_depth(robot, braced, angles) -> None:
    """Wherever the arm is, the force is that of the depth by the robot's own kinematics."""
    posture, pads = moved(robot, braced, angles), pads_of(robot)
    pads.linearize(posture)
    pads.torque(posture, STILL, STEP)
    depth = max(0.0, -distance(robot, posture))
    assert pads.force[0] == pytest.approx(robot.brace.stiffness * depth, rel=1e-6, abs=1e-3)


@given(st.lists(SMALL, min_size=4, max_size=4), st.lists(SMALL, min_size=4, max_size=4))
def test_the_pads_never_pull_and_friction_holds_no_more_than_it_can(
    robot, braced, first, second
) -> None:
    """Over any path of two places, the tangential force is at most friction times the normal."""
    pads = pads_of(robot)
    for angles in (first, second):
        posture = moved(robot, braced, angles)
        pads.linearize(posture)
        pads.torque(posture, STILL, STEP)
        assert pads.force[0] >= 0.0
        assert np.hypot(*pads.force[1:]) <= robot.brace.friction * pads.force[0] + 1e-9


@given(st.lists(st.floats(-0.004, 0.004), min_size=4, max_size=4))
def test_a_closed_path_of_the_arm_gains_no_energy(robot, braced, swing) -> None:
    """The work of the pads on the joints over one period of a swing is never positive."""
    pads, work = pads_of(robot), 0.0
    count = 400
    angles = 2.0 * np.pi * np.arange(2 * count + 1) / count
    path = [moved(robot, braced, np.array(swing) * np.sin(angle)) for angle in angles]
    for index in range(2 * count):
        middle = 0.5 * (path[index] + path[index + 1])
        rate = (path[index + 1] - path[index]) / STEP
        if index % 4 == 0:
            pads.linearize(middle)
        torque = pads.torque(middle, rate, STEP)
        if index >= count:  # in the first period the pads find the place where friction holds
            work += STEP * float(np.sum(torque * rate))
    assert work <= 1e-3


def test_the_force_on_the_elbow_reaches_the_trunk_through_the_pads(robot, braced) -> None:
    """Pressed from the side, the arm needs less than a third of the torques of a free arm."""
    model, pads = RobotModel(robot), pads_of(robot)
    q = model.configuration(np.zeros(3), braced)
    columns = model.v_index[[robot.index(name) for name in ARM]]
    push = model.contact_jacobian(q)[:, columns].T @ np.array([0.0, 1000.0, 0.0])
    pads.linearize(braced)
    jacobian = pads.jacobian[:, [robot.index(name) for name in ARM]]
    share = np.linalg.lstsq(jacobian.T, -push, rcond=None)[0]
    left = push + jacobian.T @ share
    assert np.hypot(*share[1:]) <= robot.brace.friction * share[0]
    assert np.abs(left).max() < np.abs(push).max() / 3.0


def test_pads_that_are_too_stiff_for_a_step_press_quietly(robot, braced, paper_door) -> None:
    """Standing in the braced posture, the force stays within 5 N and the joints stand still."""
    world = World(robot, paper_door, 0.9, -0.42, posture=braced, pad_scale=1e4)
    forces = []
    for _ in range(40):
        world.step()
        forces.append(world.joints.pads.force[0])
    assert 40.0 < min(forces) < max(forces) < 62.0
    assert max(forces) - min(forces) < 5.0
    assert np.abs(world.joints.state[1]).max() < 0.02
    world.close()

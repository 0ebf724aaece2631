"""From the plan of a hit and what is measured to the passage that begins there."""

import math
from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.leaf import LeafFrame
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from walking.errors import NotReady
from walking.footsteps.footstep import Stance
from walking.passing.felt import FARTHEST, felt
from walking.passing.held import Hold


@pytest.fixture(scope="module")
def hold(task) -> Hold:
    return Hold(task.door, task.doorway, task.angle, task.stance, task.joints)


def moved(stance: Stance, x: float, y: float, yaw: float) -> Stance:
    """A stance as a whole somewhere else, seen from its middle."""
    middle = stance.middle
    place = middle.moved(x, y, yaw)
    return Stance(*(place.moved(*foot.seen_from(middle)) for foot in (stance.left, stance.right)))


def test_a_passage_begins_on_the_measured_soles_in_the_commanded_posture(hold):
    """So that it goes on where the driver's reference is, without a jump."""
    soles = moved(hold.stance, 0.01, -0.005, 0.02)
    measured = hold.joints + 0.01 * np.cos(np.arange(len(hold.joints)))
    task = hold.found(measured, soles, 0.42)
    assert (task.joints is hold.joints, task.measured is measured, task.angle) == (True, True, 0.42)
    for side in ("left", "right"):
        assert task.stance.foot(side) == pytest.approx(soles.foot(side), abs=1e-12)
    commanded = hold.joints + 0.05  # after a door that stood elsewhere
    assert hold.found(commanded + 0.01, soles, 0.42, commanded).joints is commanded
    old = hold.joints + 1.0  # of another motion
    assert hold.found(measured, soles, 0.42, old).joints is hold.joints


def test_what_is_not_the_end_of_the_hit_is_refused_with_its_value(hold):
    bent = hold.joints.copy()
    bent[3] += 0.1
    with pytest.raises(NotReady, match=r"0\.100 rad"):
        hold.found(bent, hold.stance, hold.angle)
    for x, yaw, words in ((0.2, 0.0, r"0\.200 m"), (0.0, math.radians(10.0), r"10\.0 deg")):
        with pytest.raises(NotReady, match=words):
            hold.found(hold.joints, moved(hold.stance, x, 0.0, yaw), hold.angle)
    for angle in (0.01, math.nan):
        with pytest.raises(NotReady, match="nobody holds it open"):
            hold.found(hold.joints, hold.stance, angle)
    closed = replace(hold, angle=0.0)  # as before a push
    assert closed.found(hold.joints, hold.stance, -0.001).angle == 0.0


@given(off=st.floats(-0.04, 0.04))
def test_a_surveyed_door_is_moved_to_the_hand(robot, task, off):
    """However far the survey was off, the pad then touches the face; along it nothing moves."""
    wrong = replace(task.doorway, hinge=task.doorway.hinge + [0.0, off])
    found = felt(robot, replace(task, doorway=wrong, measured=task.joints)).doorway.hinge
    right = felt(robot, replace(task, measured=task.joints)).doorway.hinge
    assert found == pytest.approx(right, abs=1e-9)
    assert found[0] == task.doorway.hinge[0]
    assert abs(LeafFrame(right, task.angle).gap(task.doorway.hinge)) < 0.01


def test_a_robot_that_leans_towards_the_door_feels_it_nearer(robot, task):
    """A lean of 1 deg brings the hand at its height of about 1 m 17 mm nearer to the door."""
    frame = robot.config.imu_frame
    _, mounted = robot.frame_pose(robot.configuration(np.zeros(3), task.joints), frame)
    upright = replace(task, measured=task.joints)
    places = []
    for lean_deg in (0.0, 1.0):
        leaning = Rotation.from_euler("x", lean_deg, degrees=True) * Rotation.from_matrix(mounted)
        places.append(felt(robot, replace(upright, attitude=leaning.as_quat())).doorway.hinge[1])
    assert places[0] == pytest.approx(felt(robot, upright).doorway.hinge[1], abs=1e-9)
    assert places[0] - places[1] == pytest.approx(0.0175, abs=0.005)


def test_a_hand_that_is_elsewhere_does_not_move_the_door(robot, task):
    away = replace(task.doorway, hinge=task.doorway.hinge - [0.0, 2.0 * FARTHEST])
    elsewhere = replace(task, doorway=away, measured=task.joints)
    assert felt(robot, elsewhere) is elsewhere

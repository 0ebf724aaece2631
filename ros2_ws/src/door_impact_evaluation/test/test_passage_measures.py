"""Definitions of a passage's figures, on logs that are made up; nothing is simulated here."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from door_impact_evaluation.run import passage_measures as measures
from door_impact_evaluation.run.body_distances import BodyDistances, body_distances
from door_model.door.config import load_door
from door_model.door.frame import frame_boxes
from hrp2_description.robot import load_robot_config
from humanoid_motion.clearance import LeafCourse, bodies_of
from humanoid_motion.motion import still
from humanoid_motion.robot_model import RobotModel
from hypothesis import given
from hypothesis import strategies as st

DOOR = load_door("paper")
HINGE = (-0.4, -0.7)
BEGIN, RELEASE, CLEAR, END = 2.0, 8.0, 8.5, 12.0  # of the walk; of the log [s]
HAND = "r_gripper"


@pytest.fixture(scope="module")
def robot():
    """The model of HRP-2."""
    return RobotModel(load_robot_config())


def distances(robot, x, y, *, angle=0.0, tilt=0.0):
    """Distances of a robot in half-sitting with base_link at x and y, seen from the hinge."""
    three = np.ones((3, 1))
    return body_distances(robot, SimpleNamespace(
        t=0.02 * np.arange(3.0), joints=three * robot.config.half_sitting,
        base_position=three * [HINGE[0] + x, HINGE[1] + y, 0.65], door_angle=np.full(3, angle),
        base_orientation=three * [math.sin(0.5 * tilt), 0.0, 0.0, math.cos(0.5 * tilt)]),
        DOOR, HINGE)


@given(x=st.floats(0.2, 0.7), y=st.floats(-1.0, 0.7), angle=st.floats(0.0, 1.5))
def test_distances_of_an_upright_robot_are_those_that_the_planner_finds(robot, x, y, angle):
    """From the leaf, which the planner's search has stand on the floor, and from the frame."""
    found, bodies = distances(robot, x, y, angle=angle), bodies_of(robot)
    motion = still(robot.config.half_sitting, np.array([HINGE[0] + x, HINGE[1] + y, 0.65]))
    feet = [link for link in found.links if link.endswith("_sole")]
    counted = [link not in feet for link in found.links]
    leaf = bodies.leaf_clearance(
        motion, LeafCourse(np.array(HINGE), np.array([angle]), DOOR.leaf.width), 0.0,
        may_touch=feet)
    assert found.leaf[0][counted].min() == pytest.approx(leaf.distance, abs=0.011)
    frame = bodies.frame_clearance(
        motion, frame_boxes(DOOR.leaf, DOOR.frame, (*HINGE, 0.0)), 0.0)
    assert found.frame[0].min() == pytest.approx(frame.distance, abs=1e-5)


def test_a_tilted_robot_is_nearer_to_the_leaf(robot):
    """2 deg towards the door move the head by far more than the hip."""
    upright, tilted = (distances(robot, 0.5, 0.5, tilt=tilt) for tilt in (0.0, math.radians(2.0)))
    nearer = dict(zip(upright.links, upright.leaf[0] - tilted.leaf[0], strict=True))
    assert nearer["HEAD_LINK1"] == pytest.approx(math.sin(math.radians(2.0)) * 0.6, abs=0.01)
    assert nearer["base_link"] < 0.015


@pytest.mark.parametrize(("x", "y", "clear"), [
    (0.45, 0.5, False), (0.45, -0.7, False), (0.45, -1.5, True), (-2.1, 0.5, False)])
def test_a_robot_is_clear_beyond_the_wall_and_outside_the_leafs_circle(robot, x, y, clear):
    """Before the door, in the circle, beyond both, and outside the circle on this side."""
    assert (distances(robot, x, y).beyond.min() > 0.0) == clear


def run_of(*, force=None, angle=None, clear=CLEAR, touched=math.nan, end=END, stood=True):
    """A made-up passage: the hit is at 0.5 s, the peak at 1 s and the catch at 1.5 s."""
    t = np.arange(0.0, end, 1e-3)
    if force is None:
        force = np.where((t >= 1.5) & (t < RELEASE), 10.0, 0.0)
        force[(t >= 0.5) & (t < 0.51)] = 500.0
    planned = np.interp(t, [BEGIN, BEGIN + 3.0], [0.4, 1.2])
    motion = SimpleNamespace(
        t=t, contact_force=force, door_angle=planned if angle is None else angle)
    at = np.arange(BEGIN, end, 0.02)
    leaf = np.where(at[:, None] < RELEASE + 0.5, [0.06, -0.002], [0.06, 0.2])
    found = BodyDistances(
        at, ("torso", HAND), leaf, np.full((len(at), 2), 0.05),
        np.where((at >= clear)[:, None], 0.01, -0.2) * np.ones((1, 2)))
    log = SimpleNamespace(motion=motion, stood=stood, frame_force=1.0 * (np.abs(t - touched) < 0.1))
    return measures.PassageRecord(
        log, np.where(t < BEGIN, -0.01, 0.03), first_motion=0.1, contact=0.5, peak=1.0,
        walk=measures.WalkedThrough(BEGIN, RELEASE, 3, planned, found))


def test_figures_of_a_passage(robot):
    """Times count from the first motion and from the hit; the hand does not count as near."""
    assert measures.summary(run_of(), robot) == {
        "passed": True, "time_s": pytest.approx(CLEAR - 0.1, abs=0.03),
        "hit_to_clear_s": pytest.approx(CLEAR - 0.5, abs=0.03), "steps": 3,
        "min_clearance_mm": pytest.approx(50.0), "hand_force_n": pytest.approx(10.0),
        "leaf_angle_error_deg": pytest.approx(0.0, abs=1e-9), "min_margin_mm": pytest.approx(30.0)}


def test_a_push_has_no_hit_and_the_hand_holds_from_its_first_contact_on(robot):
    """The contact at 0.5 s is that of the hand; what it presses with in the first 100 ms is not."""
    found = measures.summary(replace(run_of(), contact=math.nan, peak=math.nan), robot)
    assert math.isnan(found["hit_to_clear_s"])
    assert (found["passed"], found["hand_force_n"]) == (True, pytest.approx(10.0))


@given(clear=st.floats(BEGIN, 20.0), end=st.floats(RELEASE, 20.0), stood=st.booleans(),
       touched=st.sampled_from([math.nan, 4.0]))
def test_passed_is_clear_then_2_s_without_fall_and_without_a_touch(clear, end, stood, touched):
    run = run_of(clear=clear, end=end, stood=stood, touched=touched)
    long = end - clear - measures.AFTERWARDS
    if abs(long) > 0.03:  # distances have a period of 20 ms
        assert measures.passed(run) == (long > 0.0 and stood and math.isnan(touched))


@given(push=st.floats(1.6, 11.9), gap=st.floats(0.001, 0.1))
def test_what_the_hand_does_counts_from_the_catch_to_the_release(robot, push, gap):
    """100 N for 30 ms, and the leaf 0.1 rad off its course: only while it is held."""
    t = run_of().log.motion.t
    pushed = (t >= push) & (t < push + 0.03)
    force = run_of().log.motion.contact_force + 90.0 * pushed
    angle = run_of(angle=None).log.motion.door_angle + 0.1 * pushed
    found = measures.summary(run_of(force=force, angle=angle), robot)
    if not min(abs(push - edge) for edge in (1.6, BEGIN, RELEASE)) < 0.06:
        held = push < RELEASE
        assert found["hand_force_n"] == pytest.approx(100.0 if held else 10.0)
        assert found["leaf_angle_error_deg"] == pytest.approx(
            math.degrees(0.1) if held and push > BEGIN else 0.0, abs=1e-9)
    walk = run_of().walk  # a hand that had left comes near again
    leaf = walk.distances.leaf.copy()
    leaf[-1, 1] = gap
    again = replace(walk, distances=replace(walk.distances, leaf=leaf))
    assert measures.nearest(again, robot)[0] == min(gap, 0.05)


def test_without_a_walk_nothing_is_known(robot):
    found = measures.summary(replace(run_of(), walk=None), robot)
    assert (found.pop("passed"), found.pop("steps")) == (False, 0)
    assert all(math.isnan(value) for value in found.values())

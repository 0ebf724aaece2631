"""The largest angle and the largest l_B with which the arm holds a door."""

import math
from dataclasses import replace

import numpy as np
import pytest
from impact_planner.hit.placement import placement_for_step
from impact_planner.motion.catch import HoldTask, can_hold
from impact_planner.motion.reach import furthest_contact, largest_angle
from impact_planner.task.settings import PlannerSettings

SETTINGS = PlannerSettings()


@pytest.fixture(scope="module")
def placement(robot):
    """The place of the door at the end of the nominal step."""
    return placement_for_step(robot, SETTINGS, robot.config.step.nominal)


def task(known, placement, stance, angle, limit=SETTINGS.hand_force_limit):
    """The task of holding the door from the posture at the hit."""
    return HoldTask(known.door, known.width, placement.hinge, angle, stance.posture.joints,
                    stance.posture.base, stance.feet, limit, 0.9, 0.005)


def test_largest_angle_is_held_and_a_larger_one_is_not(robot, known, placement, stance):
    """The largest angle can be held, and an angle 0.5 deg above it cannot."""
    angle = largest_angle(robot, known, SETTINGS, placement, stance)
    assert math.radians(60.0) < angle < known.door.closer.opening_limit()
    assert can_hold(robot, task(known, placement, stance, angle))
    assert not can_hold(robot, task(known, placement, stance, angle + math.radians(0.5)))


def test_a_weaker_hand_holds_less_far_out_of_the_closed_position(robot, known, placement, stance):
    """Small angles need the most force, because the closer's torque falls with the angle."""
    assert can_hold(robot, task(known, placement, stance, math.radians(25.0), 12.0))
    assert not can_hold(robot, task(known, placement, stance, math.radians(12.0), 5.0))


@pytest.mark.nightly("a search along the leaf, fifteen seconds")
def test_furthest_contact_is_where_the_arm_s_reach_ends(robot, known, placement, stance):
    """45 deg can be held from the largest l_B, and not from 1 cm more."""
    angle = math.radians(45.0)
    l_b = furthest_contact(robot, known, SETTINGS, placement, stance, angle)
    assert 0.42 < l_b < known.width
    for way, held in ((0.0, True), (0.01, False)):
        hinge = np.array([stance.posture.elbow[0] - l_b - way, -placement.door_distance])
        moved = replace(task(known, placement, stance, angle), hinge=hinge)
        assert can_hold(robot, moved) is held

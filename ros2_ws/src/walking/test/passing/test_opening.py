"""Which doors are pushed from closed, which are hit, and the hand's way to the closed leaf."""

from dataclasses import replace

import numpy as np
import pytest
from door_model.door.config import load_door
from walking.errors import InvalidGoal, PassageInfeasible
from walking.footsteps.footstep import Pose, Stance
from walking.passing import opening
from walking.passing.opening import HIT, PUSH, choose_opening


@pytest.fixture(scope="module")
def choose(robot, half_sitting, doorway):
    """A function that chooses how a door of the package is opened."""
    def chosen(name, wanted="", stance=half_sitting):
        config = load_door(name)
        place = replace(doorway(), leaf=config.leaf, frame=config.frame)
        return choose_opening(robot, config.door(), place, stance, wanted)

    return chosen


@pytest.fixture(scope="module")
def light(choose):
    """The choice for the light door."""
    return choose("light")


def test_a_light_door_is_pushed_from_closed_with_what_eq_1_asks_for(light):
    """The hand presses with the closer's torque and that of the leaf's inertia, all in the plan."""
    push = light.push
    assert light.way == PUSH
    assert push.passage.push.first == 0.0
    force = np.linalg.norm(push.passage.hand_force, axis=1)
    held = float(load_door("light").door().restoring_torque(0.0)) / push.reach.radius
    assert held < force.max() < 1.5 * held
    assert min(each.checks.margin.min() for each in (push.reach.walk, push.passage.walk)) >= 0.02
    assert np.abs(push.passage.walk.knots.position[0] - push.hold.joints).max() < 1e-3
    for number in (f"{force.max():.0f} N", f"{2 * force.max():.0f} N with the reserve"):
        assert number in light.reason


@pytest.mark.parametrize("name", ["paper", "size2", "size3", "size4"])
def test_heavy_doors_are_hit(choose, name):
    found = choose(name)
    assert (found.way, found.push) == (HIT, None)
    assert "22 N are allowed" in found.reason


def test_the_planned_force_decides_with_the_reserve(choose, light, monkeypatch):
    """The door that is light is heavy where it asks for a newton more than is allowed."""
    force = np.linalg.norm(light.push.passage.hand_force, axis=1).max()
    monkeypatch.setattr(opening, "LIGHT", 2.0 * force - 1.0)
    assert choose("light").way == HIT
    monkeypatch.setattr(opening, "LIGHT", 2.0 * force + 1.0)
    assert choose("light").way == PUSH


def test_a_wanted_way_is_taken_or_refused(choose, monkeypatch):
    """The paper's door can be pushed, but by no hand that may give only 30 N."""
    assert choose("light", HIT).way == HIT
    assert choose("paper", PUSH).way == PUSH
    monkeypatch.setattr(opening, "STRONGEST", 30.0)
    with pytest.raises(PassageInfeasible, match="30 N are allowed"):
        choose("paper", PUSH)
    with pytest.raises(InvalidGoal, match="kick"):
        choose("light", "kick")


def test_a_leaf_out_of_reach_is_hit_however_light_it_is(choose, robot):
    far = Stance.around(Pose(0.0, 0.5, 0.0), robot.config.footsteps.width)
    assert "does not reach the closed leaf" in choose("light", stance=far).reason


def test_the_hand_passes_slowly_from_in_front_of_the_surveyed_face_to_behind_it(
        robot, doorway, light):
    """A door that stands 20 mm nearer or farther is met on this way, at less than 80 mm/s."""
    motion = light.push.reach.walk.motion
    hand = robot.hand_chain.place(motion.joints, motion.base).end
    away = hand[:, 1] - doorway().hinge[1] - robot.hand_radius
    late = motion.time >= 2.0
    assert away[~late].min() > 0.03
    assert away[late].max() > 0.03
    assert away[-1] < -0.02
    assert (np.abs(np.diff(away[late])) / np.diff(motion.time[late])).max() < 0.08

"""Each step of a passage lasts as long as it must, and hardly longer."""

from dataclasses import replace

import numpy as np
import pytest
from walking.footsteps.footstep import Stance
from walking.passing.settings import PassageSettings
from walking.passing.tempo import demands, nearly_holds, timed
from walking.pattern.state import standing

SETTINGS = PassageSettings()
DURATIONS = SETTINGS.durations


def nothing(_):
    """No force on the hand."""
    return lambda time: np.zeros((len(time), 3))


@pytest.fixture(scope="module")
def steps_out(robot, passage):
    """The passage's footsteps, whose first one leaves a wide stance, timed without the arm."""
    stance = Stance(passage.walk.schedule.phases[0].stance.left,
                    passage.walk.schedule.phases[0].stance.right)
    state = standing(robot, stance)
    return state, timed(robot, state, passage.walk.footsteps, passage.pattern, DURATIONS, nothing)


def test_no_step_of_a_passage_asks_too_much(robot, passage):
    assert demands(robot, passage.walk, passage.pattern).max() <= 1.06
    found = [step.duration for step in passage.walk.footsteps]
    assert DURATIONS[0] <= min(found) <= max(found) <= DURATIONS[1]


def test_only_steps_that_ask_much_are_long(robot, steps_out, passage):
    """A longer step than the shortest uses at least four fifths of what joints or soles give."""
    _, (steps, walk) = steps_out
    asked = demands(robot, walk, passage.pattern)
    long = np.array([step.duration for step in steps]) > DURATIONS[0] + 0.02
    assert long.any()
    assert not long.all()
    assert asked.max() <= 1.0
    assert asked[long].min() > 0.8


def test_durations_to_begin_with_hardly_matter(robot, steps_out, passage):
    """Steps of 0.7 and of 0.9 s lead to durations within 0.1 s of each other."""
    state, (steps, _) = steps_out
    other, _ = timed(robot, state, [replace(step, duration=0.9) for step in steps],
                     passage.pattern, DURATIONS, nothing)
    np.testing.assert_allclose([step.duration for step in other],
                               [step.duration for step in steps], atol=0.1)


def test_stronger_leaves_take_more_time(robot, steps_out, passage):
    """Under a force that turns the robot, turning steps are longer and none is shorter."""
    state, (steps, _) = steps_out

    def pressed(_):
        return lambda time: np.tile([40.0, 0.0, 0.0], (len(time), 1))

    slower, _ = timed(robot, state, steps, passage.pattern, DURATIONS, pressed)
    assert sum(step.duration for step in slower) > sum(step.duration for step in steps) + 0.05


def test_soles_nearly_hold_where_little_is_lacking_in_steps_that_might_last_longer(passage):
    walk, most = passage.walk, float(passage.walk.checks.friction.max())
    assert nearly_holds(walk, most - 0.003, DURATIONS)
    assert not nearly_holds(walk, most - 0.02, DURATIONS)
    assert not nearly_holds(walk, most, DURATIONS)
    shortest = min(step.duration for step in walk.footsteps)
    assert not nearly_holds(walk, most - 0.003, (shortest, shortest))

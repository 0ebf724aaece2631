"""The leaf's course and the torque that it needs."""

import numpy as np
import pytest
from door_model.door.config import load_door
from scipy.integrate import solve_ivp
from walking.passing.leaf_push import LeafPush

DOOR = load_door("size3").door()
PUSH = LeafPush(DOOR, 0.2, 1.1, begin=0.3, end=4.0, release=7.0)


def test_the_leaf_goes_from_the_first_angle_to_the_last_and_waits():
    angle = PUSH.at(np.array([0.0, 0.3, 4.0, 5.0, 7.0]))
    assert angle == pytest.approx([0.2, 0.2, 1.1, 1.1, 1.1])


def test_a_leaf_at_rest_needs_the_closers_torque():
    """Before the push, and after it until the release; nothing after the release."""
    torque = PUSH.torque(np.array([0.1, 5.0, 7.5]))
    assert torque == pytest.approx(
        [DOOR.restoring_torque(0.2), DOOR.restoring_torque(1.1), 0.0], rel=1e-9)


def test_the_torque_moves_the_leaf_as_planned():
    """Eq. (1) integrated with this torque gives the planned angles."""
    def motion(time, state):
        return [state[1], float(DOOR.acceleration(
            state[0], state[1], PUSH.torque(np.array([time]))[0]))]

    time = np.linspace(0.0, 5.0, 26)
    found = solve_ivp(motion, (0.0, 5.0), [0.2, 0.0], t_eval=time, rtol=1e-9, atol=1e-10)
    assert found.y[0] == pytest.approx(PUSH.at(time), abs=1e-4)


def test_a_leaf_that_was_let_go_falls_as_by_the_equation_of_motion():
    time = np.linspace(7.0, 7.8, 9)
    fall = solve_ivp(lambda _, s: [s[1], float(DOOR.acceleration(s[0], s[1]))], (7.0, 7.8),
                     [1.1, 0.0], t_eval=time, rtol=1e-9, atol=1e-10)
    assert PUSH.at(time) == pytest.approx(fall.y[0], abs=1e-4)
    assert PUSH.at(time)[-1] < 1.1 - 0.05

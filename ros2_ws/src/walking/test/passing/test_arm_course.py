"""The search of the arm's course."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walking.passing.arm_course import _newton_step


@settings(max_examples=20)
@given(st.integers(5, 12), st.integers(1, 4), st.integers(0, 2**31))
def test_a_step_solves_the_linearised_problem(count, joints, seed):
    """The banded system is that of the dense normal equations."""
    random = np.random.default_rng(seed)
    arm = random.normal(size=(count, joints))
    residuals = random.normal(size=(count, 3))
    slopes = random.normal(size=(count, 3, joints))
    bend, damping = 0.03 * random.uniform(0.3, 1.0, size=joints), 0.5
    found = _newton_step((residuals, slopes), arm, bend, damping)
    rows, values = [], []
    for node in range(2, count):
        for residual, slope in zip(residuals[node], slopes[node], strict=True):
            row = np.zeros((count, joints))
            row[node] = slope
            rows.append(row[2:].ravel())
            values.append(residual)
        for joint in range(joints):
            row, weight = np.zeros((count, joints)), 1.0 / bend[joint]
            row[node - 2 : node + 1, joint] = weight * np.array([1.0, -2.0, 1.0])
            rows.append(row[2:].ravel())
            values.append(weight * (np.array([1.0, -2.0, 1.0]) @ arm[node - 2 : node + 1, joint]))
    a, b = np.array(rows), np.array(values)
    dense = np.linalg.solve(a.T @ a + damping * np.eye(a.shape[1]), -a.T @ b)
    assert found.ravel() == pytest.approx(dense, abs=1e-6)


def test_the_arm_keeps_its_ranges_and_speeds(robot, passage):
    columns = robot.arm_columns
    arm = passage.walk.motion.joints[:, columns]
    assert (arm >= robot.lower[columns]).all()
    assert (arm <= robot.upper[columns]).all()
    speed = np.abs(passage.walk.motion.joint_speed[:, columns])
    assert (speed <= 0.9 * robot.speed_limit[columns] + 1e-9).all()

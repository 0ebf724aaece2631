"""The braced posture: the load of the hit runs through the pads into the trunk."""

import numpy as np
import pytest
from humanoid_motion.clearance import BodyGeometry
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.motion import still
from humanoid_motion.robot_model import RobotModel, braced_upper_body
from impact_planner.hit.brace import DEPTH, braced_arm, load_path
from impact_planner.hit.stance import initial_base


def test_the_load_of_the_configured_posture_runs_through_the_pads(robot, plan):
    """The elbow, the ball and the disc lie in one frontal plane, and the pads' force holds."""
    found = load_path(robot)
    assert abs(found.aside) < 1e-3
    assert found.beside < 0.25 * robot.config.brace.trunk.size
    assert found.depth == pytest.approx(DEPTH, abs=2e-4)
    assert found.inclination < found.cone
    assert 0.0 < plan.pad_friction < 0.95
    assert plan.joint_loads[0].share < 0.5


@pytest.mark.parametrize("distance", [0.42, 0.44])
def test_a_found_posture_leans_on_its_pad(robot, distance):
    """It presses the pads by the depth, in one plane, and the hand keeps the clearance."""
    arm = braced_arm(robot, distance)
    braced = RobotModel(arm.of(robot.config))
    found = load_path(braced)
    assert found.depth == pytest.approx(DEPTH, abs=1e-5)
    assert abs(found.aside) < 1e-5
    assert found.beside < 1e-5
    assert -arm.elbow[1] == pytest.approx(distance, abs=1e-5)
    posture = still(braced_upper_body(braced), initial_base(braced))
    limit = robot.config.clearance
    assert BodyGeometry(braced).self_clearance(posture, limit).distance >= limit
    margin = np.minimum(braced_upper_body(braced) - braced.lower,
                        braced.upper - braced_upper_body(braced))
    assert margin[robot.arm_columns].min() >= 0.01


def test_the_configured_posture_is_one_of_them(robot):
    """For its own elbow's distance the posture is the configured one to 0.1 deg."""
    q = robot.configuration(np.zeros(3), braced_upper_body(robot))
    arm = braced_arm(robot, -float(robot.contact_position(q)[1]))
    for joint, angle in arm.joints.items():
        if joint in robot.config.braced_posture:
            assert angle == pytest.approx(robot.config.braced_posture[joint], abs=2e-3)


def test_a_flatter_forearm_needs_less_friction(robot):
    """The farther the elbow, the smaller is the angle between forearm and normal of the pad."""
    angles = [load_path(RobotModel(braced_arm(robot, distance).of(robot.config))).inclination
              for distance in (0.41, 0.43, 0.45)]
    assert angles == sorted(angles, reverse=True)


def test_an_elbow_out_of_the_arm_s_reach_is_refused(robot):
    """An elbow farther than shoulder and upper arm allow is refused with its distance."""
    with pytest.raises(PostureUnreachable, match="cannot lean") as caught:
        braced_arm(robot, 0.60)
    assert caught.value.value == 0.60

"""Loads of the hit on floor and gears: what is warned about, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.robot_model import TOWARDS_DOOR, RobotModel
from impact_planner.errors import GearOverload
from impact_planner.hit.floor_load import LARGEST_SLIP, floor_load, require_no_slip
from impact_planner.hit.hit_response import HitSimulation, Switch
from impact_planner.hit.hit_structure import hit_structure
from impact_planner.hit.placement import Placement
from impact_planner.hit.stance import LeafContact, contact_with_leaf
from impact_planner.hit.transfer import leaf_to_hit
from impact_planner.plan import plan_impact
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import PlannerSettings


@pytest.fixture(scope="module")
def response(robot, stance, known):
    """A hit with 0.42 m/s on the paper's door."""
    posture, settings = stance.posture, PlannerSettings()
    hinge = np.array([-0.42, posture.elbow[1] - robot.config.contact_radius])
    contact = contact_with_leaf(posture.elbow, robot.config.contact_radius, hinge, 0.0)
    placement = Placement(-float(hinge[1]), float(hinge[0]))
    structure = hit_structure(
        robot, posture.base, posture.joints, stance.feet, np.array(TOWARDS_DOOR))
    return HitSimulation(structure, leaf_to_hit(known, settings, placement, contact, 0.0, 0.5)).hit(
        0.42, Switch(0.018, 0.01, 0.2))


def test_soles_slip_in_the_hit_only_where_it_asks_for_more_friction_than_there_is(
        robot, stance, response):
    """The slip is 0 with enough friction, and increases to that of ice with less friction."""

    def load(available):
        return floor_load(robot.mass, stance.posture, response, response.impulse, available)

    needed = load(1.0).friction
    assert load(1.001 * needed).slip == 0.0
    slips = [load(share * needed).slip for share in (0.9, 0.5, 0.1, 1e-9)]
    assert slips == sorted(slips)
    assert slips[0] > 0.0
    assert slips[-1] == pytest.approx(
        0.5 * response.duration * np.hypot(*response.floor[:2]) * response.slide)
    assert 1.0 / robot.mass < response.slide < 6.0 / robot.mass
    require_no_slip(load(0.5), 0.5)
    far = floor_load(robot.mass, stance.posture, response, 3.0 * response.impulse, 0.01)
    with pytest.raises(PostureUnreachable) as caught:
        require_no_slip(far, 0.01)
    assert caught.value.limit == LARGEST_SLIP < caught.value.value


def test_the_leaf_s_surface_is_the_same_wherever_the_elbow_meets_it(known):
    """Farther from the hinge the elbow meets less mass, but neither spring nor damper changes."""
    placement, settings = Placement(0.715, -0.4), PlannerSettings()
    near, far = (leaf_to_hit(
        known, settings, placement, LeafContact(np.zeros(3), np.array(TOWARDS_DOOR), l_b), 0.0, 0.5)
        for l_b in (0.35, 0.5))
    assert near.surface == far.surface


def test_a_gear_whose_teeth_would_skip_is_refused(robot, known, plan):
    """Beyond the ratcheting torque there is no plan; the error has quantity, value and limit."""
    (load,) = (each for each in plan.joint_loads if each.joint == "RARM_JOINT3")
    limit = 0.9 * abs(load.gear_torque)
    drives, weak = robot.config.drives, robot.config.index("RARM_JOINT3")
    limits = {name: getattr(drives, name).copy() for name in ("peak_torque", "ratcheting_torque")}
    limits["peak_torque"][weak], limits["ratcheting_torque"][weak] = 0.5 * limit, limit
    weak = RobotModel(replace(robot.config, drives=replace(drives, **limits)))
    with pytest.raises(GearOverload, match="RARM_JOINT3") as caught:
        plan_impact(PlanRequest(math.radians(25.0)), known, weak)
    assert caught.value.limit == limit < caught.value.value
    assert caught.value.value == pytest.approx(abs(load.gear_torque), rel=0.01)


def test_pads_that_the_posture_does_not_press_are_no_brace(robot, known):
    """With a pad that is farther in, the plan warns and counts on the free arm alone."""
    brace = robot.config.brace
    place = np.array(brace.trunk.place) - 0.003 * np.array(brace.normal)
    far = RobotModel(replace(robot.config, brace=replace(
        brace, trunk=replace(brace.trunk, place=tuple(place.tolist())))))
    request = PlanRequest(math.radians(7.5), ending="retreat")
    found = plan_impact(request, known, far)
    bare = plan_impact(request, known, RobotModel(replace(robot.config, brace=None)))
    assert [each for each in found.warnings if "does not press the pads" in each]
    assert found.v_rb == pytest.approx(bare.v_rb)
    assert found.pad_force == 0.0

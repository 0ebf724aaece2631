"""The figure of a plan shows everything at its place."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from door_model.door.config import load_door
from hrp2_description.data import share_folders
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.clearance import bodies_of
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.leaf import LeafFrame
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import PlannerSettings
from impact_planner.tools.outlines import body_outlines, skeleton, surface_points
from impact_planner.tools.plan_scene import caught_after, configuration_at, door_course, plan_scene

TALOS = Path(__file__).parents[1] / "talos.yaml"
AJAR = math.radians(8.0)
SETTINGS = PlannerSettings()
needs_talos = pytest.mark.skipif(
    not any(folder.is_dir() for folder in share_folders("example-robot-data")),
    reason="example-robot-data is not installed",
)
# Case: robot.yaml, door, opening angle [deg], further fields of the request.
CASES = {
    "mcv50-hold": (None, "paper", 25.0, {}),
    "mcv50-retreat": (None, "paper", 25.0, {"ending": "retreat"}),
    "zmp_limited-hold": (None, "size3", 25.0, {"run_up": "zmp_limited"}),
    "zmp_limited-retreat": (None, "size3", 25.0, {"run_up": "zmp_limited", "ending": "retreat"}),
    "ajar-hold": (None, "paper", 25.0, {"initial_angle": AJAR}),
    "ajar-retreat": (None, "paper", 25.0, {"initial_angle": AJAR, "ending": "retreat"}),
    "stoppable": (None, "paper", 11.0, {}),
    "talos-hold": (TALOS, "paper", 25.0, {}),
    "talos-retreat": (TALOS, "paper", 25.0, {"ending": "retreat"}),
}
PARAMS = [
    pytest.param(name, marks=needs_talos if robot else ())
    for name, (robot, *_) in CASES.items()
]


@cache
def model(path):
    """The model of a robot by the path of its robot.yaml; None means HRP-2."""
    return RobotModel(load_robot_config(path))


@cache
def planned(name):
    """Plan and robot of a case."""
    path, door, degrees, wanted = CASES[name]
    config, robot = load_door(door), model(path)
    known = KnownDoor(config.name, config.door(), config.leaf.width)
    request = PlanRequest(math.radians(degrees), **wanted)
    return plan_impact(request, known, robot, SETTINGS), robot


@pytest.fixture(params=PARAMS)
def case(request):
    """Plan, robot and scene of a case."""
    plan, robot = planned(request.param)
    return plan, robot, plan_scene(plan, robot)


@pytest.mark.parametrize("suffix", ["png", "pdf"])
def test_the_figure_is_written_in_silence(case, suffix, tmp_path, caplog, recwarn):
    """Every case is drawn without warnings or log messages."""
    pytest.importorskip("matplotlib")
    from impact_planner.tools.plotting import draw_plan

    plan, robot, _ = case
    path = tmp_path / f"plan.{suffix}"
    draw_plan(plan, robot, SETTINGS, path)
    assert path.read_bytes()[:4] == {"png": b"\x89PNG", "pdf": b"%PDF"}[suffix]
    assert not caplog.records
    assert not recwarn.list


def test_b_is_on_the_leaf_where_the_elbow_touches_it(case):
    """B is on the leaf at l_B, one radius from the centre of the contact body."""
    plan, robot, scene = case
    leaf = LeafFrame(scene.hinge, plan.initial_angle)
    assert leaf.gap(scene.b) == pytest.approx(0.0, abs=1e-6)
    assert leaf.radius(scene.b) == pytest.approx(plan.l_b, abs=1e-6)
    elbow = robot.contact_position(scene.q_hit)
    assert np.linalg.norm(scene.b - elbow) == pytest.approx(robot.config.contact_radius, abs=2e-4)


def test_c_is_on_the_inner_edge_of_the_right_sole(case):
    """C is on the inner edge, and the projection of G is inside the sole beside it."""
    _, robot, scene = case
    corners = robot.feet["right"].corners(scene.feet["right"])
    assert scene.c[1] == pytest.approx(corners[:, 1].max())
    assert scene.c[2] == 0.0
    assert corners[:, 0].min() < scene.c[0] < corners[:, 0].max()
    inside = scene.c[1] - scene.com[1]
    assert inside == pytest.approx(SETTINGS.com_inside_edge, abs=2e-4)
    assert scene.com[0] == scene.c[0]


def test_a_r_and_b_r_are_the_heights_that_are_drawn(case):
    """a_r is the height of B above G, and b_r is the height of G above the floor."""
    plan, _, scene = case
    assert scene.com[2] == pytest.approx(plan.b_r, abs=2e-4)
    assert scene.b[2] - scene.com[2] == pytest.approx(plan.a_r, abs=2e-4)


def test_the_soles_are_on_the_floor_where_the_plan_has_them(case):
    """The soles are in place at the hit and at the end, and the right one moved by the step."""
    plan, robot, scene = case
    for q in (scene.q_hit, scene.q_end):
        ends = skeleton(robot, q)[-2:, 1]
        for side, end in zip(robot.feet, ends, strict=True):
            np.testing.assert_allclose(end, scene.feet[side], atol=2e-4)
    way = scene.feet_start["right"] - scene.feet["right"]
    np.testing.assert_allclose(way, [0.0, plan.hit.stance.step, 0.0], atol=1e-9)


def test_bodies_stand_on_the_floor_on_the_robot_s_side_of_the_leaf(case):
    """No body is below the floor or inside the leaf."""
    plan, robot, scene = case
    leaf = LeafFrame(scene.hinge, plan.initial_angle)
    behind = body_outlines(robot, scene.q_hit, (1, 2), np.array([-1.0, 0.0, 0.0]))
    above = body_outlines(robot, scene.q_hit, (0, 1), np.array([0.0, 0.0, 1.0]))
    assert len(behind) == len(above) == len(bodies_of(robot).links)
    assert min(outline.points[:, 1].min() for outline in behind) > -0.01
    assert min(leaf.gap(point) for outline in above for point in outline.points) > -1e-3
    assert [outline.near for outline in above] == sorted(outline.near for outline in above)


def test_the_leaf_s_corners_lie_along_its_face_and_behind_it(case):
    """Two corners lie on the face, one of them on the arc, and two behind it."""
    plan, _, scene = case
    angle = plan.desired_opening_angle
    leaf, corners = LeafFrame(scene.hinge, angle), scene.leaf_corners(angle)
    np.testing.assert_allclose(
        [leaf.gap(corner) for corner in corners], [0.0, 0.0, -scene.thickness, -scene.thickness],
        atol=1e-12)
    np.testing.assert_allclose(scene.arc(scene.width, 0.0, angle)[-1], corners[1], atol=1e-12)


def test_the_hand_that_holds_is_on_the_leaf(case):
    """The hand is on the leaf at the desired angle, or far from it after a retreat."""
    plan, robot, scene = case
    leaf = LeafFrame(scene.hinge, plan.desired_opening_angle)
    if plan.ending == "hold":
        assert leaf.gap(scene.hand_end) == pytest.approx(robot.hand_radius(), abs=1e-3)
        assert leaf.gap(scene.elbow_end) > robot.config.contact_radius
    else:
        assert leaf.gap(scene.hand_end) > 0.3


def test_the_run_up_goes_from_its_start_to_the_hit(case):
    """The CoM goes from the start to the hit, and the ZMP stays within the soles."""
    plan, _, scene = case
    assert scene.com_course[0, 1] == pytest.approx(plan.hit.run_up.y_start, abs=1e-6)
    np.testing.assert_allclose(scene.com_course[-1], scene.com, atol=5e-3)
    np.testing.assert_allclose(scene.steady.mean(axis=0), scene.com)
    low, high = scene.support.min(axis=0), scene.support.max(axis=0)
    assert np.all(low < scene.zmp_course)
    assert np.all(scene.zmp_course < high)


def test_the_point_of_no_return_is_on_the_run_up_before_the_hit(case):
    """The point is the CoM's place at its time, before the hit."""
    plan, _, scene = case
    cam = plan.phase("cam")
    time = plan.contact_time - plan.point_of_no_return
    assert scene.no_return[1] == pytest.approx(np.interp(time, cam.time, cam.com_samples[:, 1]))
    assert scene.no_return[1] > scene.com[1]


def test_the_door_opens_to_the_peak_and_falls_back(case):
    """The door opens to its peak, closes without a jump, and is led by the hand."""
    plan, robot, _ = case
    time, angle, start = door_course(plan)
    assert np.all(np.diff(time) > 0.0)
    assert angle[0] == plan.initial_angle
    free = angle[time < start]
    assert free.max() == pytest.approx(plan.peak_angle, abs=2e-3)
    assert time[np.argmax(free)] == pytest.approx(plan.peak_time, abs=0.03)
    assert np.abs(np.diff(angle)).max() < 0.02
    if plan.ending == "hold":
        caught = start + caught_after(plan, robot)
        assert angle[-1] == pytest.approx(plan.desired_opening_angle, abs=1e-3)
        falling = (time > start) & (time < caught)
        assert np.all(np.diff(angle[falling]) < 0.0)
        assert 0.0 < angle[time >= caught].min() < angle[time >= caught][0]
    else:
        assert angle[-1] < 0.5 * plan.peak_angle


def test_a_configuration_stands_on_its_left_sole(case):
    """In every phase, the left sole is at its place."""
    plan, robot, scene = case
    for phase in plan.phases:
        q = configuration_at(plan, robot, phase, 0.5 * float(phase.time[-1]))
        sole = robot.frame_position(q, robot.feet["left"].frame)
        np.testing.assert_allclose(sole, scene.feet["left"], atol=1e-12)


@pytest.mark.parametrize("path", [None, pytest.param(TALOS, marks=needs_talos)])
def test_points_of_a_shape_fill_its_bounding_box(path):
    """Points fill the box of a shape exactly, or to 1 % of the radius of a round one."""
    for item in bodies_of(model(path)).shapes.geometryObjects:
        shape, points = item.geometry, surface_points(item.geometry)
        shape.computeLocalAABB()
        slack = 0.01 * getattr(shape, "radius", 1e-4)
        np.testing.assert_allclose(points.min(axis=0), shape.aabb_local.min_, atol=slack)
        np.testing.assert_allclose(points.max(axis=0), shape.aabb_local.max_, atol=slack)


def test_the_support_polygon_holds_both_soles(case):
    """The support polygon has the extent of both soles at the hit."""
    _, robot, scene = case
    corners = np.vstack([robot.feet[side].corners(scene.feet[side]) for side in SIDES])
    np.testing.assert_allclose(scene.support.min(axis=0), corners.min(axis=0), atol=1e-8)
    np.testing.assert_allclose(scene.support.max(axis=0), corners.max(axis=0), atol=1e-8)

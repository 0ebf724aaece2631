"""The replay of a run by the simulation's log, and the page of a demonstration."""

import base64
from collections import defaultdict
from types import SimpleNamespace as Some

import numpy as np
import pytest
from door_impact_evaluation.report import report, table
from door_impact_evaluation.report.recorded_run import padded
from door_impact_evaluation.report.replay import replay_of
from door_impact_evaluation.report.run_replay import run_of_log
from door_impact_evaluation.report.table import Row
from door_impact_evaluation.run.record import Motion, Support
from door_impact_view.replay.recording import Replay
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config

T = np.arange(0.0, 4.0, 1e-3)
CONTACT, PEAK = 2.0, 3.5
PHASES = {"cam": (1.0, CONTACT), "post": (CONTACT, PEAK), "hold": (PEAK, 3.9)}
PLAN = Some(desired_opening_angle=0.4, v_rb=0.5,
            zmp_margins=[Some(phase="cam", margin=0.01), Some(phase="post", margin=0.02)])


@pytest.fixture(scope="module")
def run():
    """HRP-2 slides along x at 0.1 m/s and hits a door that opens at 0.2 rad/s."""
    robot, n = load_robot_config(), len(T)
    zeros = np.zeros(n)
    along = np.column_stack([0.1 * T, zeros, zeros])
    motion = Motion(
        t=T, left_wrench=np.zeros((n, 6)), right_wrench=np.zeros((n, 6)), left_sole=along,
        right_sole=along, left_heading=zeros, right_heading=zeros,
        base_orientation=np.tile([0.0, 0.0, 0.6, 0.8], (n, 1)),
        door_angle=0.2 * np.clip(T - CONTACT, 0.0, None), door_velocity=zeros,
        contact_force=100.0 * (np.abs(T - CONTACT) < 0.01) + 27.0 * (T > PEAK),
        point_b_velocity=zeros,
        joints=np.tile(T[:, None], (1, len(robot.joint_names))), base_position=along, com=along)
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    support = Support(along[:, :2], np.full(n, 0.05), zeros, zeros, [square], np.zeros(n, int))
    log = Some(robot=robot, motion=motion, door_distance=0.6, hinge_x=-0.4)
    record = Some(support=support, phases=PHASES, contact_time=CONTACT, peak_time=PEAK)
    return run_of_log(record, log, PLAN, load_door("paper"))


def test_robot_and_door_move_as_in_the_log(run):
    """From the first phase to the end of the last one, with every millisecond at the contact."""
    replay = replay_of(run)
    robot, door = replay.trees
    t = replay.stamps
    assert (t[0], t[-1]) == pytest.approx((1.0, 3.9))
    assert np.diff(t[np.abs(t - CONTACT) < 0.1]).max() == pytest.approx(1e-3)
    np.testing.assert_allclose(robot.positions, np.tile(t[:, None], (1, len(robot.joints))))
    np.testing.assert_allclose(robot.base[:, 0], 0.1 * t)
    np.testing.assert_allclose(robot.base[:, 3:], np.tile([0.8, 0.0, 0.0, 0.6], (len(t), 1)))
    np.testing.assert_allclose(door.positions[:, 0], 0.2 * np.clip(t - CONTACT, 0.0, None))
    np.testing.assert_allclose(door.base, [[-0.4, -0.6, 0.0, 1.0, 0.0, 0.0, 0.0]])
    assert replay.begin == CONTACT
    assert [phase.name for phase in replay.phases] == list(PHASES)


def test_plots_show_what_was_measured_beside_the_plan(run):
    """Angles in degrees, margins in millimetres; phases without a planned margin have a gap."""
    plots = {plot.title: plot for plot in replay_of(run).plots}
    angle, margin = plots["Angle of the door"], plots["ZMP margin"]
    assert angle.curves[0].values[-1] == pytest.approx(np.degrees(0.2 * 1.9))
    assert angle.limits[0].value == pytest.approx(np.degrees(0.4), abs=1e-3)
    measured, planned = margin.curves
    assert measured.values == pytest.approx(50.0)
    np.testing.assert_array_equal(planned.values, [10.0, 10.0, np.nan, 20.0, 20.0, np.nan])
    assert (np.diff(planned.t) > 0.0).all()
    blow, hand = (plots[f"Force of the {body} on the door"].curves[0]
                  for body in ("elbow", "hand"))
    assert (blow.values.max(), hand.values.max()) == (100.0, 27.0)


def test_polygons_of_any_number_of_corners_fit_in_one_array():
    """The corners stay; the last one is repeated; an empty polygon is unknown."""
    triangle, square = np.eye(3)[:, :2], np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    found = padded([triangle, np.empty((0, 2)), square])
    np.testing.assert_array_equal(found[0, :, :2], triangle[[0, 1, 2, 2]])
    assert np.isnan(found[1]).all()
    np.testing.assert_array_equal(found[2, :, :2], square)


def measured(passage=None, *, held=24.9, peak=25.3):
    """The table's column of a run that fell if the door stayed shut; other figures are 1."""
    one = defaultdict(lambda: 1.0)
    return {row.name: row.measured for row in table.rows({
        "identified": defaultdict(lambda: one), "plan": one, "impact": one, "passage": passage,
        "door": {"target_deg": 25.0, "peak_deg": peak, "error_deg": peak - 25.0, "held_deg": held},
        "robot": {"gear_load": {"knee": 0.5}, "foot_slip_mm": 0.1, "fell": peak < 0.0},
        "zmp": {"measured_min_margin_mm": {"cam": 9.0}}, "run": {"engine": "mujoco"}}, 24.0)}


@pytest.mark.parametrize(("held", "passage"), [(25.2, None), (13.3, {
    "time_s": 21.34, "steps": 11, "hand_force_n": 31.0, "leaf_angle_error_deg": None,
    "min_clearance_mm": 42.0, "min_margin_mm": 20.0})])
def test_a_door_that_was_walked_through_was_not_held(held, passage):
    """Then the table has rows of the passage, and none of an angle to hold; both catch it."""
    rows = measured(passage, held=held)
    assert ("angle at which the hand holds the door" in rows) == (passage is None)
    assert "angle at which the hand stops the closing door" in rows
    assert [rows.get(name) for name in (
        "first motion to clear of the door", "steps through the door",
        "smallest distance from leaf and frame",
        "error: largest of the leaf's angle against the plan")] == (
            [None] * 4 if passage is None else ["21.3", "11", "42.0", "-"])


@pytest.mark.parametrize(("peak", "shown"), [(-0.003, ["-"] * 4), (24.96, [
    "1.000", "24.96", "-0.04", "24.90"])])
def test_the_table_has_dashes_where_the_door_was_not_opened(peak, shown):
    """Speed of the door, largest angle, its error and the held angle; no -0.00."""
    rows = measured(peak=peak)
    assert [rows[name] for name in (
        "door speed after the hit w', measured", "largest opening angle",
        "error: largest less desired angle", "angle at which the hand holds the door")] == shown


def test_the_page_of_a_demonstration_is_one_file(tmp_path):
    """It contains the pictures beside it, and texts with any character are escaped."""
    (tmp_path / "zmp.png").write_bytes(b"a picture")
    path = tmp_path / "report.html"
    report.write([Row("a<b", "<= 2", "3 & 4", "m")], "It opened.", ["5 < 6"],
                 Replay(np.array([0.0, 1.0])), path)
    text = path.read_text(encoding="utf-8")
    for escaped in ("a&lt;b", "&lt;= 2", "3 &amp; 4", "5 &lt; 6"):
        assert escaped in text
    assert base64.b64encode(b"a picture").decode() in text
    assert 'src="zmp.png"' not in text

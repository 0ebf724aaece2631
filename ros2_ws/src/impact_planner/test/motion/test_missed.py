"""A missed contact: the capture point of a run-up that meets no door."""

import math

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_model.door.config import load_door
from impact_planner.motion.missed import way_to_stop
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import make_settings


def planned(robot, degrees, door="paper", run_up="mcv50", **settings):
    """A plan for a door that stands where the planner likes."""
    return plan_impact(
        PlanRequest(math.radians(degrees), run_up=run_up),
        KnownDoor.configured(load_door(door)), robot, make_settings(settings, robot))


def test_the_capture_point_is_where_an_inverted_pendulum_comes_to_rest():
    """A pendulum over the capture point ends there; over a nearer point it falls past it."""
    height, speed = 0.74, 0.4
    foot = way_to_stop(speed, height)
    for ahead, rests in ((0.0, True), (0.005, True), (-0.005, False)):
        y, v, step = 0.0, speed, 1e-4
        for _ in range(20_000):
            v += GRAVITY / height * (y - foot - ahead) * step
            y += v * step
            if v < 0.0 or y > foot + 0.1:
                break
        assert (y <= foot + 1e-3) is rests


def test_the_margin_is_that_of_the_last_instant_at_full_speed(robot):
    """Up to there the run-up has its speed, 20 mm past the contact or more; then it brakes."""
    plan = planned(robot, 25.0)
    cam, edge = plan.phase("cam"), robot.feet["right"].corners(plan.right_foot)[:, 1].min()
    y = cam.com_samples[:, 1]
    speed = -np.gradient(y, cam.time)
    last = int(np.flatnonzero(speed > 0.999 * plan.v_com)[-1])
    assert plan.hit.run_up.table.y_hit - y[last] > 0.02
    capture = y[last] - plan.v_com * math.sqrt(plan.b_r / GRAVITY)
    assert plan.missed_margin == pytest.approx(capture - edge, abs=3e-3)


def test_a_fast_hit_is_planned_with_the_com_further_inside(robot):
    """It keeps the reserve by it; without a wish for one it would not."""
    wished = planned(robot, 20.0, "size3", "zmp_limited")
    plain = planned(robot, 20.0, "size3", "zmp_limited", missed_reserve=-1.0)
    for plan, inside in ((wished, None), (plain, -0.03)):
        inner = robot.feet["right"].corners(plan.right_foot)[:, 1].max()
        found = inner - plan.hit.stance.posture.com[1]
        assert found == pytest.approx(inside, abs=1e-6) if inside else found < -0.04
    assert wished.missed_margin >= 0.03 > plain.missed_margin
    assert wished.v_rb == pytest.approx(plain.v_rb, rel=0.02)


@pytest.mark.parametrize(("degrees", "door", "run_up", "reserve", "warning"), [
    (30.0, "paper", "mcv50", (0.03, np.inf), ""),
    (40.0, "size4", "zmp_limited", (-np.inf, 0.0), "misses the door falls")])
def test_a_plan_that_does_not_leave_the_reserve_says_so(
        robot, degrees, door, run_up, reserve, warning):
    """On the paper's door up to 30 deg 30 mm are left, where a miss must not be a fall."""
    plan = planned(robot, degrees, door, run_up)
    assert reserve[0] <= plan.missed_margin < reserve[1]
    assert any("fall" in each and warning in each for each in plan.warnings) is bool(warning)

"""The run-up: speed at the contact, ZMP and the stop after a missed contact."""

import numpy as np
import pytest
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import inverse_dynamics
from humanoid_motion.errors import JointLimit
from humanoid_motion.whole_body import require_joint_limits
from humanoid_motion.zmp import margins
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.errors import SpeedUnreachable
from impact_planner.motion.posture_table import PostureTable
from impact_planner.motion.run_up import plan_run_up, usable_overrun
from impact_planner.motion.zmp_run_up import Floor, best_run_up, fastest_run_up
from impact_planner.task.request import PlanRequest, Task, resolve
from impact_planner.task.settings import PlannerSettings


@pytest.fixture(scope="module")
def task(robot, known):
    """Make a task with a time law and settings, and with any ZMP margin allowed."""
    def make(kind="mcv50", **changes):
        settings = PlannerSettings(**{"required_margin": 0.0, "limit_share": 1.0} | changes)
        wanted = resolve(PlanRequest(0.4, run_up=kind), settings, known)
        return Task(robot, known, wanted, settings)
    return make


@pytest.fixture(scope="module")
def planned(task, stance):
    """Make a run-up at a speed of B [m/s]; the rest is as for `task`."""
    return lambda v_rb, kind="mcv50", **changes: plan_run_up(task(kind, **changes), stance, v_rb)


@pytest.fixture(scope="module", params=["mcv50", "zmp_limited"])
def run_up(planned, request):
    """A run-up at v_rB = 0.45 m/s with each time law."""
    return planned(0.45, request.param)


def at_full_speed(run_up):
    """Mask of the samples before the stop after a missed contact."""
    end = run_up.contact_time + run_up.overrun / run_up.law.speed
    return run_up.motion.time <= end + 1e-9


def speed_of_b(robot, motion, i):
    """Speed of the elbow towards the door at a sample, from its Jacobian [m/s]."""
    q = robot.configuration(motion.base[i], motion.joints[i])
    v = robot.velocity(motion.base_speed[i], motion.joint_speed[i])
    return -float((robot.contact_jacobian(q) @ v)[1])


def test_b_has_its_speed_at_the_contact_and_keeps_it(robot, run_up):
    """B has its speed at the contact to 0.2 %, over the overrun to 3 %, and exceeds the CoM's."""
    i = int(np.argmin(np.abs(run_up.motion.time - run_up.contact_time)))
    assert speed_of_b(robot, run_up.motion, i) == pytest.approx(0.45, rel=2e-3)
    last = int(np.flatnonzero(at_full_speed(run_up))[-1])
    assert run_up.motion.time[last] > run_up.contact_time + 0.05
    assert speed_of_b(robot, run_up.motion, last) == pytest.approx(0.45, rel=0.03)
    assert 1.1 < 0.45 / run_up.law.speed < 1.25


def test_stated_margin_is_that_of_the_motion(robot, stance, run_up):
    """To 1 mm by an independent inverse dynamics, as the tabulated ZMP to 0.01 mm."""
    zmp, fast = inverse_dynamics(robot, run_up.motion).zmp, at_full_speed(run_up)
    course = run_up.law.at(run_up.motion.time[fast])
    np.testing.assert_allclose(
        run_up.table.zmp(run_up.y_start - course.s, -course.v, -course.a), zmp[fast, 1], atol=1e-5)
    until = run_up.motion.time <= run_up.contact_time
    assert run_up.margin == pytest.approx(
        np.min(margins(robot, zmp[until], stance.feet, SIDES)), abs=1e-3
    )
    assert run_up.margin > 0.03


def test_too_fast_is_refused_with_a_speed_that_is_not(planned):
    """The speed that the error names can be planned, and one 2 % higher cannot."""
    with pytest.raises(SpeedUnreachable, match="mcv50 reaches") as caught:
        planned(0.8)
    limit = caught.value.limit
    assert 0.4 < limit < 0.8
    assert planned(limit * 0.99).margin >= 0.0
    with pytest.raises(SpeedUnreachable):
        planned(limit * 1.02)


def test_zmp_limited_has_no_less_margin_than_the_cam_curve(planned):
    """At 0.3 m/s, and at 0.58 m/s, where mcv50 is refused, it has 90 mm."""
    slow = planned(0.3, "zmp_limited").margin
    assert slow > planned(0.3).margin - 1e-3  # the end may limit both
    assert min(slow, planned(0.58, "zmp_limited").margin) > 0.09
    with pytest.raises(SpeedUnreachable):
        planned(0.58)


def test_zmp_limited_is_smooth_and_steady_before_the_hit(planned):
    """The course starts from rest, has a bounded jerk and ends with 20 mm at constant speed."""
    law = planned(0.58, "zmp_limited").law
    time = np.linspace(0.0, law.duration, 400)
    course = law.at(time)
    first = [course.s[0], course.v[0], course.a[0], course.jerk[0]]
    np.testing.assert_allclose(first, 0.0, atol=1e-6)
    assert np.abs(course.jerk).max() <= 40.0 + 1e-6
    np.testing.assert_allclose(np.gradient(course.s, time)[1:-1], course.v[1:-1], atol=1e-3)
    steady = course.s > law.distance - 0.0199
    np.testing.assert_allclose(course.v[steady], law.speed, rtol=1e-6)
    assert course.s[-1] == pytest.approx(law.distance)
    assert (np.diff(course.s) > -1e-9).all() or course.s.min() < 0.0


# The ZMP is that of a linear inverted pendulum.
PENDULUM = Floor(lambda y, v, a: y - 0.08 * a, (-0.35, 0.15), -0.25, 0.1, 0.015)


def test_zmp_limited_programme_finds_what_a_pendulum_allows():
    """It reaches the largest possible margin; at 5 m/s there is none."""
    law, start, stated = best_run_up(PENDULUM, 0.5)
    course = law.at(np.linspace(0.0, law.rise, 300))
    place = PENDULUM.zmp(start - course.s, -course.v, -course.a)
    margin = min(float((0.15 - place).min()), float((place + 0.35).min()))
    assert margin == pytest.approx(0.115, abs=0.02)
    assert stated == pytest.approx(margin, abs=1e-3)
    assert best_run_up(PENDULUM, 5.0) is None


def test_fastest_run_up_has_the_margin_and_a_faster_one_has_not():
    """On a linear inverted pendulum, the fastest speed has the margin, and 3 % more has not."""
    margin = 0.02
    fastest = fastest_run_up(PENDULUM, margin, 5.0)
    for factor, enough in ((0.98, True), (1.03, False)):
        found = best_run_up(PENDULUM, factor * fastest)
        assert (found is not None and found[2] >= margin) is enough


def test_overrun_ends_where_limits_begin(robot, stance, task):
    """The overrun ends at the joints' share, or 20 mm before the end of the legs' reach."""
    table = PostureTable(robot, stance, 0.08)
    speed = 0.45 / table.waist_per_com(table.y_hit)
    most = usable_overrun(task(overrun=0.08), table, speed)
    assert most == pytest.approx(table.y_hit - table.low - 0.02)
    for share in (0.70, 0.68):
        granted = usable_overrun(task(overrun=0.08, limit_share=share), table, speed)
        assert 0.02 <= granted < most
        fastest = np.abs(table.joint_slopes(table.y_hit - np.array([granted, granted + 0.0055])))
        ratio = (speed * fastest / robot.speed_limit).max(axis=1)
        assert ratio[0] <= share < ratio[1]
    with pytest.raises(JointLimit, match="% of its limit") as caught:
        usable_overrun(task(), table, 20.0)
    assert caught.value.value > caught.value.limit


@given(
    st.floats(0.1, 0.45), st.sampled_from(["mcv50", "zmp_limited"]), st.floats(0.02, 0.2))
def test_a_missed_contact_ends_at_rest_where_the_legs_still_reach(robot, planned, v_rb, kind, way):
    """With any wished overrun, the robot stops within the legs' reach."""
    try:
        plan = planned(v_rb, kind, overrun=way)
    except SpeedUnreachable:
        assert v_rb > 0.5
        return
    motion = plan.motion
    for rest in (motion.joint_speed, motion.joint_acceleration, motion.base_speed):
        np.testing.assert_allclose(rest[-1], 0.0, atol=1e-9)
    assert 0.02 - 1e-9 <= plan.overrun <= plan.table.y_hit - plan.table.low - 0.02 + 1e-9
    assert np.diff(inverse_dynamics(robot, motion).com[~at_full_speed(plan), 1]).max() < 1e-9
    require_joint_limits(robot, motion, "cam")


@pytest.mark.parametrize("kind", ["mcv50", "zmp_limited"])
def test_run_up_and_stop_after_a_missed_contact_are_one_motion(planned, kind):
    """Speeds and accelerations are the slopes of positions from its start to its end."""
    motion = planned(0.45, kind, period=2e-4).motion
    inner = slice(2, -2)
    slope = np.gradient(motion.joints, motion.time, axis=0)
    np.testing.assert_allclose(slope[inner], motion.joint_speed[inner], atol=1e-3)
    curve = np.gradient(motion.joint_speed, motion.time, axis=0)
    np.testing.assert_allclose(curve[inner], motion.joint_acceleration[inner], atol=0.1)

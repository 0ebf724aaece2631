"""Random doors and requests: a sound plan, or a refusal that names its limit."""

import math
from dataclasses import replace

import numpy as np
import pytest
from door_model.door.config import door_names, load_door
from door_model.door.door import Zone
from door_model.identification.parameters import PARAMETERS
from door_model.motion.dynamics import peak
from hrp2_description.robot import SIDES
from humanoid_motion.clearance import bodies_of
from humanoid_motion.dynamics import inverse_dynamics
from humanoid_motion.knots import TOLERANCE
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.motion import Motion
from humanoid_motion.zmp import margins
from impact_planner.errors import PLANNING_ERRORS
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import ENDINGS, RUN_UPS, PlannerSettings

SEED = 2015
QUICK, COUNT = 12, 60  # number of requests in `make test` and in `make test-all`
# Defaults of PlannerSettings: share of the joints' limits, and required ZMP margin [m].
SHARE, MARGIN = 0.9, 0.02
PERIOD = 0.005  # sampling period of the motions that are computed from the knots [s]
PRESETS = {name: load_door(name) for name in door_names()}


def some_door(rng):
    """A configured door, or one with randomly scaled parameters and features of real closers."""
    config = PRESETS[rng.choice(sorted(PRESETS))]
    door, width = config.door(), config.leaf.width
    if rng.random() < 0.5:
        return KnownDoor(config.name, door, width)
    door = replace(
        door, i_a=door.i_a * rng.uniform(0.3, 2.0), c_c=door.c_c * 10.0 ** rng.uniform(-1.0, 1.5),
        k_c=door.k_c * rng.uniform(0.2, 2.0),
        tau_c0_prime=door.tau_c0_prime * rng.uniform(0.0, 2.0),
        closer=replace(door.closer, l3=door.closer.l3 * rng.uniform(0.95, 1.05)),
        c_c_closing=rng.choice([None, 0.05, 0.5, 3.0]), friction=rng.choice([0.0, 0.3, 3.0]))
    if rng.random() < 0.3:
        door = replace(door, backcheck=Zone(rng.uniform(0.3, 1.3), 3.0), latch=Zone(0.2, 0.1))
    std = 0.03 * np.array([getattr(door, name) for name in PARAMETERS])
    return KnownDoor("random", door, rng.uniform(0.7, 1.2), PARAMETERS, np.diag(std**2))


def some_request(rng):
    """A request: most are in the range where plans are likely, the others anywhere."""
    likely = rng.random() < 0.7
    angle = math.radians(rng.uniform(10.0, 50.0) if likely else rng.uniform(0.5, 120.0))

    def maybe(low, high, often=0.3):
        return rng.uniform(low, high) if rng.random() < often else None

    return PlanRequest(
        angle,
        initial_angle=maybe(0.0, math.radians(5.0) if likely else 1.1 * angle),
        restitution=maybe(0.4, 0.8, 0.7) if likely else maybe(0.0, 1.0, 0.9),
        effective_mass=maybe(40.0, 55.0) if likely else maybe(10.0, 80.0),
        door_distance=maybe(0.7, 0.76) if likely else maybe(0.6, 0.9),
        l_b=maybe(0.3, 0.6) if likely else maybe(0.2, 0.9),
        run_up=str(rng.choice(RUN_UPS)),
        ending=str(rng.choice(ENDINGS)),
    )


@pytest.fixture(params=[*range(QUICK), *(
    pytest.param(number, marks=pytest.mark.nightly("more random requests"))
    for number in range(QUICK, COUNT))])
def answer(request, robot):
    """The door, the request, and the plan or the refusal; any other exception is an error."""
    rng = np.random.default_rng([SEED, request.param])
    known, wanted = some_door(rng), some_request(rng)
    try:
        return known, wanted, plan_impact(wanted, known, robot)
    except PLANNING_ERRORS as error:
        return known, wanted, error


def test_every_answer_is_a_sound_plan_or_a_refusal_that_names_its_limit(robot, answer):
    """No plan breaks a limit; a refusal has a sentence, a quantity, a value and a limit."""
    known, wanted, found = answer
    if isinstance(found, PLANNING_ERRORS):
        require_named(found)
        return
    require_request(wanted, found)
    require_equations(known, found)
    require_steady(found)
    require_joined(found)
    for phase in found.all_phases:
        require_limits(robot, phase)
        # At rest at its end, also the run-up without a contact. `shift` begins in `prepare`.
        if phase.name == "prepare":
            continue
        np.testing.assert_allclose(phase.knots.velocity[-1], 0.0, atol=1e-6, err_msg=phase.name)
    require_zmp(robot, found)


def require_named(error):
    """Check that a refusal has a sentence, a quantity, a finite value and a limit."""
    assert len(str(error)) > 20
    assert not {"nan", "inf", "-inf"} & set(str(error).split()), error
    assert error.quantity, error
    assert math.isfinite(error.value), error
    assert np.size(error.limit) in (1, 2), error
    assert not np.isnan(np.asarray(error.limit, dtype=float)).any(), error  # None becomes NaN


def require_request(wanted, plan):
    """Check that the plan fulfils the request."""
    assert plan.desired_opening_angle == wanted.desired_opening_angle
    assert (plan.run_up, plan.ending) == (wanted.run_up, wanted.ending)
    for name, planned, tolerance in (
        ("initial_angle", plan.initial_angle, 0.0), ("restitution", plan.restitution, 0.0),
        ("effective_mass", plan.effective_mass, 0.0),
        ("door_distance", plan.hit.placement.door_distance, 0.0), ("l_b", plan.l_b, 1e-5),
    ):
        asked = getattr(wanted, name)
        assert asked is None or planned == pytest.approx(asked, abs=tolerance), name
    default = PlannerSettings()
    if wanted.restitution is None:
        assert plan.restitution == default.restitution


def require_equations(known, plan):
    """Check eqs. (2) to (4), restitution, B on the leaf and the door's peak."""
    impulse = plan.effective_mass * (plan.v_rb - plan.v_rb_post)
    assert impulse == pytest.approx(plan.required_impulse)
    gained = known.door.i_a * plan.omega_door + plan.braking
    assert gained == pytest.approx(plan.l_b * impulse)
    parting = plan.omega_door * plan.l_b - plan.v_rb_post
    assert parting == pytest.approx(plan.apparent_restitution * plan.v_rb, abs=1e-12)
    leaf = LeafFrame(plan.hit.placement.hinge, plan.initial_angle)
    assert leaf.gap(plan.contact_point) == pytest.approx(0.0, abs=1e-6)
    assert leaf.radius(plan.contact_point) == pytest.approx(plan.l_b, abs=1e-6)
    summit = peak(known.door, plan.initial_angle, plan.omega_door)
    assert summit.angle == pytest.approx(plan.desired_opening_angle, abs=1e-5)


def require_steady(plan):
    """Check that the CoM keeps its speed over the stretch in which the door may stand."""
    cam = plan.phase("cam")
    half = 0.5 * plan.steady_way / plan.v_com
    assert cam.time[-1] >= plan.contact_time + half - 1e-9
    time = np.linspace(plan.contact_time - half, plan.contact_time + half, 50)
    place = np.interp(time, cam.time, cam.com_samples[:, 1])
    np.testing.assert_allclose(np.gradient(-place, time), plan.v_com, rtol=2e-3)


def require_joined(plan):
    """Check that each phase begins with the position and speed at the previous phase's end."""
    for before, after in zip(plan.phases, plan.phases[1:], strict=False):
        end = plan.switch_time if before.name == "cam" else before.knots.time[-1]
        assert after.knots.time[0] == 0.0
        (ends, ends_at, _), (begins, begins_at, _) = before.knots.at(end), after.knots.at(0.0)
        np.testing.assert_allclose(begins, ends, atol=1e-4, err_msg=after.name)
        np.testing.assert_allclose(begins_at, ends_at, atol=1e-2, err_msg=after.name)


def require_limits(robot, phase):
    """Check the limits of a phase, and the joints along the spline through its knots."""
    assert phase.margin >= MARGIN, phase.name
    assert phase.torque_ratio <= SHARE + 1e-9, phase.name
    assert phase.speed_ratio <= SHARE + 1e-9, phase.name
    own, *others = phase.clearances  # from leaf and frame
    assert own.distance >= own.limit, phase.name
    for other in others:
        assert other.distance >= other.limit == robot.config.clearance, phase.name
    resting = bodies_of(robot).resting(robot.config.clearance)
    assert own.limit >= resting.get(own.bodies, robot.config.clearance) - 1e-12, phase.name
    position, velocity, _ = phase.knots.at(np.arange(0.0, phase.knots.time[-1], PERIOD))
    assert (position >= robot.lower - TOLERANCE).all(), phase.name
    assert (position <= robot.upper + TOLERANCE).all(), phase.name
    assert (np.abs(velocity) <= 1.001 * SHARE * robot.speed_limit).all(), phase.name


def require_zmp(robot, plan):
    """Check the ZMP margin along the splines by Newton-Euler where no external force acts."""
    for name in ("shift", "cam"):
        knots = plan.phase(name).knots
        end = plan.contact_time if name == "cam" else knots.time[-1]
        motion = on_left_sole(robot, knots, np.arange(0.0, end, PERIOD), plan.left_foot)
        feet = {"left": plan.left_foot, "right": plan.right_foot}
        if name == "shift":
            feet["right"] = plan.right_foot + np.array([0.0, plan.hit.stance.step, 0.0])
        zmp = inverse_dynamics(robot, motion).zmp
        assert margins(robot, zmp, feet, SIDES).min() >= MARGIN - 1e-3, name


def on_left_sole(robot, knots, time, sole):
    """The motion of the joints at times (N,) [s] with the left sole at a place (3,) [m]."""
    joints, speed, acceleration = knots.at(time)
    chain = robot.leg_chains["left"]
    base = sole - chain.place(joints, np.zeros((len(time), 3))).end
    base_speed = np.gradient(base, time, axis=0, edge_order=2)
    base_acceleration = np.gradient(base_speed, time, axis=0, edge_order=2)
    return Motion(time, joints, speed, acceleration, base, base_speed, base_acceleration)

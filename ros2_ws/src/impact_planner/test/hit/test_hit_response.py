"""The hit response against independently written rigid-body mechanics, and its limits."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest
from hrp2_description.robot import SIDES
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.robot_model import TOWARDS_DOOR, RobotModel
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.hit import momentum
from impact_planner.hit.floor_load import LARGEST_SLIP, FloorLoad, floor_load, require_no_slip
from impact_planner.hit.hit_response import hit_response

SHORT = 1e-10  # duration of a contact in which the rubber does not yield [s]
CONTACT = 0.015  # usual duration of a contact [s]
YAW = st.floats(-0.6, 0.6)  # yaw angle of the leaf's normal [rad]
FRICTION = st.floats(0.0, 2.0)


@pytest.fixture(scope="module")
def at_hit(robot, stance):
    """The robot's configuration at the hit."""
    return robot.configuration(stance.posture.base, stance.posture.joints)


def turned(yaw):
    """The normal of a leaf, pointing into the door and turned by a yaw angle [rad]."""
    return np.array([np.sin(yaw), -np.cos(yaw), 0.0])


def respond(robot, q, yaw=0.0, friction=0.0, duration=SHORT):
    """The response to a hit on a leaf that is turned by a yaw angle [rad]."""
    return hit_response(
        robot, q, normal=turned(yaw), leaf_friction=friction, duration=duration)


@dataclass(frozen=True)
class Body:
    """The robot as one rigid body, on soles whose middle neither slides nor turns on the floor.

    Attributes:
        mass: Mass [kg].
        com: Position of the CoM in odom, (3,) [m].
        inertia: Moments of inertia about the CoM, axes of odom, (3, 3) [kg m^2].
        sole: Middle between the soles in odom, (3,) [m].
        elbow: Centre of the elbow in odom, (3,) [m].
    """

    mass: float
    com: np.ndarray
    inertia: np.ndarray
    sole: np.ndarray
    elbow: np.ndarray

    @classmethod
    def of(cls, robot, q):
        """Make the body from Pinocchio's composite rigid body and the places of its frames."""
        data = robot.model.createData()
        pin.ccrba(robot.model, data, q, np.zeros(robot.model.nv))
        middles = []
        for side in SIDES:
            x_min, x_max, y_min, y_max = robot.feet[side].rectangle
            middles.append(robot.frame_position(q, robot.feet[side].frame) + np.array(
                [0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.0]))
        return cls(data.Ig.mass, np.array(data.com[0]), np.array(data.Ig.inertia),
                   np.mean(middles, axis=0), robot.contact_position(q))

    def after(self, point, force, stuck=None):
        """Velocity of the CoM, angular velocity and the floor's (F_x, F_y, M_z) after an impulse.

        Args:
            point: Place where the impulse acts, (3,) [m].
            force: Impulse, (3,) [N s].
            stuck: Direction in which the point cannot move, (3,).
        """
        inertia = np.zeros((6, 6))
        inertia[:3, :3], inertia[3:, 3:] = self.mass * np.eye(3), self.inertia
        held = np.vstack([self.moves(self.sole)[:2], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
        if stuck is not None:
            held = np.vstack([held, stuck @ self.moves(point)])
        k = len(held)
        system = np.block([[inertia, -held.T], [held, np.zeros((k, k))]])
        found = np.linalg.solve(system, np.append(self.moves(point).T @ force, np.zeros(k)))
        return found[:3], found[3:6], found[6:9]

    def moves(self, point):
        """Jacobian of a point's velocity by those of the body, (3, 6)."""
        return np.hstack([np.eye(3), -pin.skew(point - self.com)])


def touched(robot, body, normal):
    """The point of the elbow that touches a leaf with a given normal, (3,) [m]."""
    return body.elbow + robot.config.contact_radius * normal


def sliding(robot, body, normal):
    """Velocity with which the elbow slides on a smooth leaf after 1 N s, (3,) [m/s]."""
    point = touched(robot, body, normal)
    speed = body.moves(point) @ np.concatenate(body.after(point, -normal)[:2])
    return speed - normal * (normal @ speed)


@given(yaw=YAW)
def test_a_short_hit_on_a_smooth_leaf_meets_the_rigid_robot_s_mass(robot, at_hit, yaw):
    """The mass is 1 / (J M^-1 J^T) of a rigid body with horizontally fixed soles."""
    body, normal = Body.of(robot, at_hit), turned(yaw)
    speed, turn, _ = body.after(body.elbow, -normal)
    towards = normal @ (speed + np.cross(turn, body.elbow - body.com))
    assert respond(robot, at_hit, yaw).mass == pytest.approx(-1.0 / towards, rel=1e-6)


def test_eq_3_is_the_mass_of_a_short_hit_at_the_center_of_percussion(robot, at_hit, stance):
    """The mass agrees with eq. (3) to 0.5 %; eq. (3) neglects yaw, which the soles prevent."""
    posture = stance.posture
    planar = momentum.effective_mass_planar(robot.mass, posture.i_rob, posture.a_r)
    assert respond(robot, at_hit).mass == pytest.approx(planar, rel=5e-3)


def test_hit_at_the_center_of_percussion_the_floor_has_no_part_in_it(robot, at_hit):
    """Where eq. (5) holds, the floor's impulse is below 1 % of the hit's in every direction."""
    assert np.abs(respond(robot, at_hit).floor).max() < 0.01


@given(yaw=YAW, friction=FRICTION)
def test_floor_and_leaf_give_the_robot_its_momentum(robot, at_hit, yaw, friction):
    """Impulses of floor and leaf satisfy Newton-Euler, and the soles neither slide nor turn."""
    body, normal = Body.of(robot, at_hit), turned(yaw)
    found = respond(robot, at_hit, yaw, friction)
    point, slide = touched(robot, body, normal), sliding(robot, body, normal)
    along = slide / np.linalg.norm(slide)
    stops = np.linalg.norm(slide) / (along @ body.moves(point) @ np.concatenate(
        body.after(point, along)[:2]))
    leaf = -normal - min(friction, stops) * along
    speed = (found.floor + leaf) / body.mass
    moment = np.cross(point - body.com, leaf) + np.cross(body.sole - body.com, found.floor)
    moment[2] = np.cross(point - body.com, leaf)[2] + found.floor_yaw
    turn = np.linalg.solve(body.inertia, moment)
    sole = speed + np.cross(turn, body.sole - body.com)
    np.testing.assert_allclose([*sole[:2], turn[2], found.floor[2]], 0.0, atol=1e-6)
    towards = normal @ (speed + np.cross(turn, point - body.com))
    assert towards == pytest.approx(-1.0 / found.mass, abs=1e-6)


@given(yaw=YAW)
def test_the_brace_keeps_the_arm_in_one_piece_with_the_robot(robot, at_hit, yaw):
    """The brace's torques are those of Newton-Euler for an arm that turns with the trunk."""
    body, normal = Body.of(robot, at_hit), turned(yaw)
    speed, turn, _ = body.after(body.elbow, -normal)
    model, data = robot.model, robot.model.createData()
    change, zero = np.zeros(model.nv), np.zeros(model.nv)
    change[:6] = [*(speed + np.cross(turn, at_hit[:3] - body.com)), *turn]
    inertial = pin.rnea(model, data, at_hit, zero, change) - pin.rnea(
        model, data, at_hit, zero, zero)
    leaf = robot.contact_jacobian(at_hit).T @ -normal
    brace = respond(robot, at_hit, yaw).brace
    assert list(brace) == list(robot.config.braced_joints)
    columns = robot.v_index[robot.indices(list(brace))]
    np.testing.assert_allclose(list(brace.values()), (inertial - leaf)[columns], atol=1e-6)


def test_the_shoulder_carries_the_brace(robot, at_hit):
    """The shoulder roll carries 0.16 N m s per N s on a smooth leaf, and 0.23 on a rough one."""
    for friction, carried in ((0.0, 0.16), (0.3, 0.23)):
        brace = respond(robot, at_hit, friction=friction, duration=CONTACT).brace
        assert max(brace, key=lambda joint: abs(brace[joint])) == "RARM_JOINT1"
        assert abs(brace["RARM_JOINT1"]) == pytest.approx(carried, abs=0.02)


@given(yaw=YAW, friction=st.tuples(FRICTION, FRICTION), duration=st.floats(1e-4, 0.03))
def test_friction_and_rubber_make_the_robot_heavier(robot, at_hit, yaw, friction, duration):
    """More friction, and a longer contact on rubber, never reduce the effective mass."""
    less, more = sorted(friction)
    light = respond(robot, at_hit, yaw, less, duration).mass
    assert respond(robot, at_hit, yaw, more, duration).mass >= light * (1.0 - 1e-9)
    assert light > respond(robot, at_hit, yaw, less).mass


def test_friction_presses_the_robot_on_its_soles(robot, at_hit):
    """The elbow slides upwards on the leaf, so that friction increases the floor's force."""
    body = Body.of(robot, at_hit)
    assert sliding(robot, body, np.array(TOWARDS_DOOR))[2] > 0.0
    smooth, rough = (
        respond(robot, at_hit, friction=friction, duration=CONTACT).floor[2]
        for friction in (0.0, 0.3))
    assert smooth < rough


@given(yaw=YAW, friction=st.floats(5.0, 1e6))
def test_friction_stops_the_slide_and_never_reverses_it(robot, at_hit, yaw, friction):
    """With any large friction, the mass is that of an elbow that sticks along its slide."""
    body, normal = Body.of(robot, at_hit), turned(yaw)
    point, slide = touched(robot, body, normal), sliding(robot, body, normal)
    speed, turn, _ = body.after(point, -normal, stuck=slide / np.linalg.norm(slide))
    towards = normal @ (speed + np.cross(turn, point - body.com))
    assert respond(robot, at_hit, yaw, friction).mass == pytest.approx(-1.0 / towards, rel=1e-6)


def test_a_length_of_the_normal_changes_nothing(robot, at_hit):
    """Only the direction of the normal matters."""
    once, thrice = (
        hit_response(robot, at_hit, normal=scale * turned(0.2), leaf_friction=0.3,
                     duration=CONTACT)
        for scale in (1.0, 3.0))
    assert thrice.mass == pytest.approx(once.mass, rel=1e-12)


def test_soles_without_rubber_meet_a_long_hit_as_a_short_one(robot, at_hit):
    """Without rubber, the effective mass does not depend on the contact's duration."""
    hard = RobotModel(replace(robot.config, sole_rubber=None))
    assert respond(hard, at_hit, duration=CONTACT).mass == pytest.approx(
        respond(robot, at_hit).mass, rel=1e-6)


def load(robot, posture, response, impulse, available) -> FloorLoad:
    """The load on the floor of a hit with a contact of 15 ms."""
    return floor_load(robot.mass, posture, response, impulse, 0.015, available)


def test_soles_slip_in_the_hit_only_where_it_asks_for_more_friction_than_there_is(
        robot, at_hit, stance):
    """The slip is 0 with enough friction, and increases to that of ice with less friction."""
    response = hit_response(
        robot, at_hit, normal=TOWARDS_DOOR, leaf_friction=0.3, duration=0.015)
    needed = load(robot, stance.posture, response, 19.4, 1.0).friction
    assert load(robot, stance.posture, response, 19.4, 1.001 * needed).slip == 0.0
    slips = [load(robot, stance.posture, response, 19.4, share * needed).slip
             for share in (0.9, 0.5, 0.1, 1e-9)]
    assert slips == sorted(slips)
    assert slips[0] > 0.0
    assert slips[-1] == pytest.approx(0.5 * 0.015 * 19.4 * response.slide)


def test_soles_that_slip_far_are_refused_with_way_and_limit(robot, at_hit, stance):
    """A slip above its limit is refused with value and limit."""
    response = hit_response(
        robot, at_hit, normal=TOWARDS_DOOR, leaf_friction=0.3, duration=0.015)
    require_no_slip(load(robot, stance.posture, response, 19.4, 0.5), 0.5)
    with pytest.raises(PostureUnreachable, match="slip by") as caught:
        require_no_slip(load(robot, stance.posture, response, 40.0, 0.05), 0.05)
    assert caught.value.limit == LARGEST_SLIP < caught.value.value

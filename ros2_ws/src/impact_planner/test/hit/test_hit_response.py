"""The simulated hit against independently written mechanics, and its limits."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest
from door_model.door.config import load_door
from door_model.door.surface import mass_of_hit, surface
from door_model.motion.dynamics import peak
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.hit import hit_response, momentum
from impact_planner.hit.hit_response import HitSimulation, LeafToHit, Switch
from impact_planner.hit.hit_structure import hit_structure

YAW = st.floats(-0.6, 0.6)  # yaw angle of the leaf's normal [rad]
SPEED = st.floats(0.15, 0.8)  # speed of B before the hit [m/s]
SWITCH = Switch(delay=0.018, slow_down=0.01, ratio=0.2)
L_B = 0.42  # distance of B from the hinge [m]


def turned(yaw):
    """The normal of a leaf, pointing into the door and turned by a yaw angle [rad]."""
    return np.array([np.sin(yaw), -np.cos(yaw), 0.0])


def leaf(friction=0.3, restitution=0.5, duration=0.015, torque=9.1, i_a=12.75):
    """The paper's leaf with some differences."""
    return LeafToHit(
        i_a, L_B, torque, surface(restitution, duration, mass_of_hit(i_a, L_B)), friction)


def simulation(robot, stance, yaw=0.0, **changes):
    """Hits of a robot in a stance on a leaf that is turned by a yaw angle [rad]."""
    posture = stance.posture
    structure = hit_structure(robot, posture.base, posture.joints, stance.feet, turned(yaw))
    return HitSimulation(structure, leaf(**changes))


@pytest.fixture(scope="module")
def rigid(robot):
    """The robot with rigid joints, which needs no brace, on soles that do not resist tilt."""
    return RobotModel(replace(robot.config, drives=None, brace=None, sole_rubber=None))


@dataclass(frozen=True)
class Body:
    """The robot as one rigid body, on soles whose middle neither slides nor turns on the floor."""

    mass: float
    com: np.ndarray  # (3,) in odom, as all places [m]
    inertia: np.ndarray  # about the CoM, axes of odom, (3, 3) [kg m^2]
    sole: np.ndarray  # middle between the soles
    elbow: np.ndarray  # its centre

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

    def after(self, point, force):
        """Velocity of the CoM, angular velocity and the floor's (F_x, F_y, M_z) after an impulse.

        It is `force`, (3,) [N s], and acts at `point`, (3,) [m].
        """
        inertia = np.zeros((6, 6))
        inertia[:3, :3], inertia[3:, 3:] = self.mass * np.eye(3), self.inertia
        held = np.vstack([self.moves(self.sole)[:2], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
        system = np.block([[inertia, -held.T], [held, np.zeros((3, 3))]])
        found = np.linalg.solve(system, np.append(self.moves(point).T @ force, np.zeros(3)))
        return found[:3], found[3:6], found[6:9]

    def moves(self, point):
        """Jacobian of a point's velocity by those of the body, (3, 6)."""
        return np.hstack([np.eye(3), -pin.skew(point - self.com)])


@pytest.fixture(scope="module")
def at_hit(robot, stance):
    """The robot's configuration at the hit."""
    return robot.configuration(stance.posture.base, stance.posture.joints)


@given(yaw=YAW, v_rb=SPEED)
def test_a_rigid_robot_shows_the_mass_of_a_rigid_body(rigid, stance, at_hit, yaw, v_rb):
    """On a smooth leaf the mass is 1 / (J M^-1 J^T) with horizontally fixed soles."""
    body, normal = Body.of(rigid, at_hit), turned(yaw)
    point = body.elbow + rigid.config.contact_radius * normal
    speed, turn, _ = body.after(point, -normal)
    towards = normal @ (speed + np.cross(turn, point - body.com))
    found = simulation(rigid, stance, yaw, friction=0.0).hit(v_rb, SWITCH)
    assert found.mass == pytest.approx(-1.0 / towards, rel=1e-6)


def test_eq_3_is_the_mass_of_a_rigid_robot_hit_at_its_center_of_percussion(rigid, stance):
    """The mass agrees with eq. (3) to 0.5 %; eq. (3) neglects yaw, which the soles prevent."""
    posture = stance.posture
    planar = momentum.effective_mass_planar(rigid.mass, posture.i_rob, posture.a_r)
    found = simulation(rigid, stance, friction=0.0).hit(0.4, SWITCH)
    assert found.mass == pytest.approx(planar, rel=5e-3)
    assert np.abs(found.floor).max() < 0.01 * found.impulse


@given(yaw=YAW, v_rb=SPEED)
def test_floor_and_braced_joints_carry_what_newton_and_euler_ask_for(
        rigid, stance, at_hit, yaw, v_rb):
    """Impulses of floor and joints of a rigid robot on a smooth leaf are those of one body."""
    body, normal = Body.of(rigid, at_hit), turned(yaw)
    point = body.elbow + rigid.config.contact_radius * normal
    found = simulation(rigid, stance, yaw, friction=0.0).hit(v_rb, SWITCH)
    speed, turn, held = body.after(point, -found.impulse * normal)
    np.testing.assert_allclose(found.floor, [*held[:2], 0.0], atol=1e-6)
    lever = body.sole - body.com
    assert found.floor_yaw == pytest.approx(
        held[2] + np.cross(lever, [*held[:2], 0.0])[2], abs=1e-6)
    model, data = rigid.model, rigid.model.createData()
    change, zero = np.zeros(model.nv), np.zeros(model.nv)
    change[:6] = [*(speed + np.cross(turn, at_hit[:3] - body.com)), *turn]
    inertial = pin.rnea(model, data, at_hit, zero, change) - pin.rnea(
        model, data, at_hit, zero, zero)
    elbow = rigid.frame_jacobian(at_hit, rigid.config.contact_link)
    touching = elbow[:3] - pin.skew(rigid.config.contact_radius * normal) @ elbow[3:]
    columns = rigid.v_index[rigid.indices(rigid.config.braced_joints)]
    torque = inertial + found.impulse * touching.T @ normal
    joints = rigid.indices(rigid.config.braced_joints)
    np.testing.assert_allclose(found.joint_impulse[joints], torque[columns], atol=1e-6)


def test_a_rigid_robot_on_a_smooth_leaf_shows_the_surface_s_restitution(rigid, stance):
    """Where nothing else gives, the apparent restitution is that of the surface to 0.03."""
    found = simulation(
        rigid, stance, friction=0.0, restitution=0.7, torque=0.0).hit(0.4, SWITCH)
    assert found.restitution == pytest.approx(0.7, abs=0.03)
    assert found.duration == pytest.approx(0.015, abs=1.5e-3)


def test_endlessly_stiff_gears_and_servos_make_the_robot_rigid(robot, stance):
    """With stiff gears, servos and heavy rotors, mass and w' are those of rigid joints to 1 %."""
    drives = robot.config.drives
    stiff = replace(
        drives.scaled(gear=3e3, rotor=1e4), position_gain=1e4 * drives.position_gain,
        speed_gain=1e4 * drives.speed_gain)
    hard = RobotModel(replace(
        robot.config, drives=stiff, effort_limit=1e6 * robot.config.effort_limit))
    joined = RobotModel(replace(robot.config, drives=None, brace=None))
    late = replace(SWITCH, ratio=1.0)
    one, other = (simulation(each, stance).hit(0.4, late) for each in (hard, joined))
    assert one.mass == pytest.approx(other.mass, rel=0.01)
    assert one.omega == pytest.approx(other.omega, rel=0.01)


@given(v_rb=SPEED, friction=st.floats(0.0, 0.8), restitution=st.floats(0.2, 0.8),
       gear=st.sampled_from([0.5, 1.0, 2.0]), pad=st.sampled_from([0.5, 1.0, 2.0]))
def test_a_hit_creates_no_energy_and_keeps_the_door_s_momentum(
        robot, stance, robots, v_rb, friction, restitution, gear, pad):
    """The apparent restitution is below 1, and the impulse is that of door and closer."""
    found = simulation(
        robots[gear, pad], stance, friction=friction, restitution=restitution).hit(v_rb, SWITCH)
    assert 0.0 < found.restitution < 1.0
    given = L_B * found.impulse - 9.1 * found.duration
    assert 12.75 * found.omega_end == pytest.approx(given, abs=0.01 + 1e-3 * given)
    assert 20.0 < found.mass < robot.mass + 30.0
    assert 0.0 <= found.pad_friction <= 1.0 + 1e-9


@pytest.fixture(scope="module")
def robots(robot):
    """The robot by the factors of its gears' and its pads' stiffness."""
    config, factors = robot.config, (0.5, 1.0, 2.0)
    return {(gear, pad): RobotModel(replace(
        config, drives=config.drives.scaled(gear=gear), brace=replace(
            config.brace, stiffness=pad * config.brace.stiffness,
            damping=pad * config.brace.damping))) for gear in factors for pad in factors}


@given(friction=st.tuples(st.floats(0.0, 0.8), st.floats(0.0, 0.8)))
def test_friction_of_the_leaf_makes_the_robot_heavier(robot, stance, friction):
    """The elbow slides upwards as the robot turns, so that friction presses it on its soles."""
    less, more = (simulation(robot, stance, friction=each).hit(0.4, SWITCH)
                  for each in sorted(friction))
    assert more.mass >= less.mass - 0.5
    assert more.floor[2] >= less.floor[2] - 0.1


def test_without_the_brace_the_shoulder_is_overloaded(robot, stance):
    """The free arm loads the shoulder roll's gear beyond its peak torque, the braced one below."""
    free = RobotModel(replace(robot.config, brace=None))
    column, limit = robot.config.index("RARM_JOINT1"), robot.config.drives.peak_torque
    braced, bare = (simulation(each, stance).hit(0.55, SWITCH) for each in (robot, free))
    assert abs(braced.gear[column]) < 0.5 * limit[column]
    assert abs(bare.gear[column]) > limit[column]
    assert bare.pad_force == bare.pad_preload == bare.pad_friction == 0.0
    assert bare.restitution < braced.restitution - 0.2


def test_the_pads_lift_the_elbow_until_gears_and_servos_bear_their_force(robot, stance):
    """It is a millimetre; gears and servos twice as stiff give half as far for the same force."""

    def lifted(stiffer):
        drives = robot.config.drives.scaled(gear=stiffer)
        drives = replace(drives, position_gain=stiffer * drives.position_gain)
        one, bare = (hit_structure(
            RobotModel(replace(robot.config, drives=drives, brace=brace)), stance.posture.base,
            stance.posture.joints, stance.feet, turned(0.0))
            for brace in (robot.config.brace, None))
        height = one.touch[0, 3] - bare.touch[0, 3]
        return abs(height), one.pads.preload[0]

    (soft, less), (stiff, more) = lifted(1.0), lifted(2.0)
    assert 5e-4 < soft < 2e-3
    assert stiff / more == pytest.approx(0.5 * soft / less, rel=0.01)


def test_w_hardly_depends_on_the_integration_step(robot, stance, monkeypatch):
    """Half the step changes w' by less than 0.1 %, with friction that changes its direction."""
    omega = simulation(robot, stance).hit(0.42, SWITCH).omega
    monkeypatch.setattr(hit_response, "_STEP", 0.5 * hit_response._STEP)
    assert simulation(robot, stance).hit(0.42, SWITCH).omega == pytest.approx(omega, rel=1e-3)


def test_motors_give_no_more_than_their_limit(robot, stance):
    """The impulse of a motor is at most its limit times the contact's duration, at any speed."""
    found = simulation(robot, stance).hit(1.5, SWITCH)
    most = robot.effort_limit * found.duration
    assert (np.abs(found.motor_impulse) <= most + 1e-9).all()
    weak = RobotModel(replace(robot.config, effort_limit=0.2 * robot.config.effort_limit))
    assert simulation(weak, stance).hit(1.5, SWITCH).mass < found.mass


@pytest.mark.parametrize("name", ["paper", "size3"])
def test_w_is_that_of_an_instant_hit_that_opens_the_door_as_far(robot, stance, name):
    """From the contact's end the door opens as far as from an instant hit with w': to 0.5 %."""
    door = load_door(name).door()
    torque = float(door.restoring_torque(0.0))
    found = simulation(robot, stance, torque=torque, i_a=door.i_a).hit(0.45, SWITCH)
    opened = peak(door, found.angle_end, found.omega_end).angle
    assert peak(door, 0.0, found.omega).angle == pytest.approx(opened, rel=5e-3)
    assert opened > 1.005 * peak(door, 0.0, found.omega_end).angle


def test_the_longest_contact_that_settings_allow_is_simulated_to_its_end(robot, stance):
    """Elbow and leaf part within the simulated time; the impulse is the whole one."""
    duration = 0.1
    found = simulation(robot, stance, duration=duration).hit(0.4, SWITCH)
    assert 0.85 * duration < found.duration < 0.2  # the legs slow down meanwhile
    assert found.v_rb_post < 0.42 * found.omega_end

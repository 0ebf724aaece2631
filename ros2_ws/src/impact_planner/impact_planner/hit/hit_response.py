"""Simulation of the hit in time, with everything that gives.

The elbow runs into the leaf's surface, a spring and damper that cannot pull (`door_model`'s
`surface`). Behind the elbow the arm leans on the trunk through pads; each joint hangs on its motor
by the gear, a spring and damper; the rotor's inertia is on the motor's side, where a PD servo with
a limited torque follows the commanded course; the soles stand on rubber. The references keep the
speed of the run-up until the switch to the motion after the hit. The system is linear except for
the contacts, their friction and the limits of the motors, and is integrated by the implicit
midpoint rule, which neither adds nor removes energy by itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_model.door.surface import Surface

from impact_planner.hit.hit_contacts import ROWS, Contacts, ContactState
from impact_planner.hit.hit_structure import HitStructure, reduced

_STEP = 5e-5  # integration step, at which w' is right to 0.1 %: friction changes its direction [s]
_LONGEST = 0.25  # longest contact that is simulated [s]; the settings allow 0.1 s on a rigid arm
_AFTER = 0.01  # time after the contact over which the speed of B is the mean of v'_rB [s]
_PEAK = 1e-3  # time over which the largest force is a mean [s]
_STICKS = 1e5  # force of the leaf's friction by the speed with which an elbow that sticks creeps
_LEAF, _PADS = slice(0, 3), slice(3, 6)  # rows of the contacts


@dataclass(frozen=True)
class LeafToHit:
    """The leaf at the hit.

    Attributes:
        i_a: Moment of inertia I_A about the hinge [kg m^2].
        l_b: Distance of B from the hinge [m].
        torque: Torque of closer and hinge friction that shuts the door [N m].
        surface: Spring and damper between elbow and leaf.
        friction: Coefficient of friction between elbow and leaf.
    """

    i_a: float
    l_b: float
    torque: float
    surface: Surface
    friction: float


@dataclass(frozen=True)
class Switch:
    """When and how the references leave the run-up.

    Attributes:
        delay: Time from the start of the contact to the switch [s].
        slow_down: Time in which the speed then falls [s].
        ratio: Speed after that, as a share of the run-up's.
    """

    delay: float
    slow_down: float
    ratio: float


@dataclass(frozen=True)
class HitResponse:
    """What a hit does to leaf and robot.

    Attributes:
        v_rb: Speed of B before the hit [m/s].
        v_rb_post: Mean speed of B along the leaf's normal in the 10 ms after the contact, in which
            the elbow swings about the robot's speed [m/s].
        omega: w' of a hit in an instant that opens the door as far: the energy that the closer
            takes during the contact is added to the leaf's [rad/s].
        angle_end: Angle by which the leaf has opened at the end of the contact [rad].
        omega_end: Angular velocity of the leaf there [rad/s].
        impulse: Impulse of the elbow on the leaf along the normal [N s].
        duration: Duration of the contact [s].
        peak_force: Largest force on the leaf [N].
        restitution: Apparent coefficient of restitution, (w' l_B - v'_rB) / v_rB.
        floor: Impulse of the floor on the robot beyond that of standing, axes of odom, (3,) [N s].
        floor_yaw: Impulse of the floor's moment about the vertical through the CoM [N m s].
        slide: Speed that the soles would reach per impulse of the floor that is missing [1/kg].
        gear: Torques of the gears where they are largest during the hit, (J,) [N m]; zero where
            the joints are rigid.
        joint_impulse: Impulse of the torque at each joint of the upper body that the hit adds,
            (J,) [N m s]; of rigid legs it is not defined.
        motor_impulse: Impulse of each motor's torque, (J,) [N m s].
        pad_force: Largest normal force of the pads [N].
        pad_preload: Their force before the hit [N].
        pad_friction: Impulse of the pads' friction as a share of what friction could give.
    """

    v_rb: float
    v_rb_post: float
    omega: float
    angle_end: float
    omega_end: float
    impulse: float
    duration: float
    peak_force: float
    restitution: float
    floor: Array
    floor_yaw: float
    slide: float
    gear: Array
    joint_impulse: Array
    motor_impulse: Array
    pad_force: float
    pad_preload: float
    pad_friction: float

    @property
    def mass(self) -> float:
        """Effective mass m_re at B: impulse over change of B's speed [kg]."""
        return self.impulse / (self.v_rb - self.v_rb_post)


class HitSimulation:
    """Hits of one robot in one posture on one leaf.

    Args:
        structure: The robot in the posture of the hit.
        leaf: The leaf.
    """

    def __init__(self, structure: HitStructure, leaf: LeafToHit) -> None:
        self._structure, self._leaf = structure, leaf
        self._mass, damping, stiffness = reduced(structure, leaf.i_a)
        self._joints = structure.motions[structure.columns]  # (J, F)
        self._rows, springs, dampers, friction = self._contacts()
        self._springs, self._dampers = springs, dampers
        self._drives = _Drives(structure) if structure.drives is not None else None
        matrix = 2.0 / _STEP * self._mass + damping + 0.5 * _STEP * stiffness
        if self._drives is not None:
            size = len(self._mass) - 1
            matrix[:size, :size] += self._joints.T @ (
                self._drives.resists[:, None] * self._joints)
        self._yields = np.linalg.inv(matrix)
        self._stiffness = stiffness
        self._pushes = self._yields @ self._rows.T
        self._solver = Contacts(
            self._rows @ self._pushes, dampers + 0.5 * _STEP * springs, friction)

    def _contacts(self) -> tuple[Array, Array, Array, Array]:
        """Return rows (3 C, F + 1), springs, dampers (3 C,) and friction (C,) of the contacts."""
        structure, leaf = self._structure, self._leaf
        surface = leaf.surface
        rows = [np.column_stack([structure.touch @ structure.motions, [-leaf.l_b, 0.0, 0.0]])]
        springs, dampers = [surface.stiffness, 0.0, 0.0], [surface.damping, _STICKS, _STICKS]
        friction = [leaf.friction]
        if structure.pads is not None:
            pads = structure.pads
            rows.append(np.column_stack([pads.row @ structure.motions, np.zeros(3)]))
            springs, dampers = [*springs, *pads.stiffness], [*dampers, *pads.damping]
            friction.append(pads.friction)
        return np.vstack(rows), np.array(springs), np.array(dampers), np.array(friction)

    def hit(self, v_rb: float, switch: Switch) -> HitResponse:
        """Simulate a hit.

        Args:
            v_rb: Speed of B along the leaf's normal before it [m/s].
            switch: When the references leave the run-up.
        """
        structure, leaf, drives = self._structure, self._leaf, self._drives
        count, size = len(self._springs), len(self._mass)
        place, speed = np.zeros(size), np.zeros(size)
        closer = np.zeros(size)
        closer[-1] = -leaf.torque
        approach = np.zeros(count)
        approach[_LEAF] = v_rb * structure.approach
        preload = np.zeros(count)
        deep = np.zeros(count)  # displacement of each contact's spring
        if structure.pads is not None:
            preload[_PADS] = structure.pads.preload
            deep[_PADS] = preload[_PADS] / self._springs[_PADS]
        pressed = self._rows.T @ preload
        gear = motor = np.zeros(len(structure.columns))
        inert, half = 2.0 / _STEP * self._mass, 0.5 * _STEP
        if drives is not None:
            drives.start(v_rb * structure.run_up[structure.columns], switch)
        course: list[tuple[Array, ...]] = []
        states = [ContactState()] * (count // ROWS)
        last = 0
        for number in range(round(_LONGEST / _STEP)):
            push = inert @ speed - self._stiffness @ place + closer + pressed
            if drives is not None:
                push[:-1] += drives.push(number, self._joints @ place[:-1]) @ self._joints
            free = self._yields @ push
            at_rest = self._springs * (deep + half * approach) + self._dampers * approach
            force, states = self._solver.solve(at_rest, self._rows @ free, states)
            middle = free - self._pushes @ force
            if speed[-1] + 2.0 * (middle[-1] - speed[-1]) < 0.0:
                middle[-1] = 0.5 * speed[-1]  # the frame bears the shut door
            speed = 2.0 * middle - speed
            place = place + _STEP * middle
            deep = deep + _STEP * (approach + self._rows @ middle)
            self._slip(deep, force, states)
            if drives is not None:
                gear, motor = drives.advance(self._joints @ middle[:-1])
            course.append((force, speed, place, gear, motor))
            if force[0] > 0.0:
                last = number
            elif (number - last) * _STEP >= _AFTER:
                break
        return self._response(v_rb, course, last + 1, preload)

    def _slip(self, deep: Array, force: Array, states: list[ContactState]) -> None:
        """Let the springs of tangents that slide keep only what friction holds."""
        for contact, state in enumerate(states):
            along = slice(ROWS * contact + 1, ROWS * (contact + 1))
            if not state.acts:
                deep[along] = 0.0
            elif state.slide is not None and self._springs[along].all():
                deep[along] = force[along] / self._springs[along]

    def _response(
        self, v_rb: float, course: list[tuple[Array, ...]], steps: int, preload: Array
    ) -> HitResponse:
        """Sum up a hit.

        Args:
            v_rb: Speed of B before the hit [m/s].
            course: Forces of the contacts, speeds, places, torques of gears and of motors in each
                step.
            steps: Number of the steps in which elbow and leaf touched.
            preload: Forces of the contacts before the hit, (3 C,) [N].
        """
        structure, leaf = self._structure, self._leaf
        columns = [np.array(rows) for rows in zip(*course, strict=True)]
        of_b = v_rb + columns[1][steps - 1:, :-1] @ self._rows[0, :-1]
        force, speeds, places, gears, motors = (rows[:steps] for rows in columns)
        given = _STEP * (force - preload).sum(axis=0)
        on_robot = structure.touch.T @ given[_LEAF]
        if structure.pads is not None:
            on_robot += structure.pads.row.T @ given[_PADS]
        # What the contacts do not explain of the change of momentum comes from floor and joints.
        rest = structure.inertia @ (structure.motions @ speeds[-1, :-1]) + on_robot
        v_post = float(of_b.mean())
        angle, omega_end = float(places[-1, -1]), float(speeds[-1, -1])
        omega = math.sqrt(omega_end**2 + 2.0 * leaf.torque * angle / leaf.i_a)
        before = structure.torque if self._drives is not None else np.zeros(gears.shape[1])
        gear = before + gears
        worst = np.argmax(np.abs(gear), axis=0)
        return HitResponse(
            v_rb=v_rb, v_rb_post=v_post, omega=omega, angle_end=angle, omega_end=omega_end,
            impulse=float(given[0]),
            duration=_STEP * len(force), peak_force=_largest_mean(force[:, 0]),
            restitution=(omega * leaf.l_b - v_post) / v_rb,
            floor=rest[:3], floor_yaw=float((rest[3:6] - np.cross(structure.com, rest[:3]))[2]),
            slide=structure.loose,
            gear=gear[worst, np.arange(gear.shape[1])],
            joint_impulse=rest[structure.columns] if self._drives is None
            else _STEP * gears.sum(axis=0),
            motor_impulse=_STEP * (before + motors).sum(axis=0),
            **_pad_load(structure, force),
        )


def _largest_mean(force: Array) -> float:
    """Compute the largest mean of a force (N,) over a millisecond [N]; it has a value per step."""
    count = round(_PEAK / _STEP)
    total = np.cumsum(np.concatenate([np.zeros(count), force]))
    return float((total[count:] - total[:-count]).max()) / count


def _pad_load(structure: HitStructure, force: Array) -> dict[str, float]:
    """Compute the fields of `HitResponse` about the pads from the contacts' forces (N, 3 C)."""
    if structure.pads is None:
        return {"pad_force": 0.0, "pad_preload": 0.0, "pad_friction": 0.0}
    normal, along = force[:, 3], np.hypot(force[:, 4], force[:, 5])
    available = structure.pads.friction * float(normal.sum())
    return {"pad_force": float(normal.max()), "pad_preload": float(structure.pads.preload[0]),
            "pad_friction": float(along.sum()) / available if available > 0.0 else 0.0}


class _Drives:
    """Motors and gears during a hit, as deviations from the run-up; arrays are (J,)."""

    def __init__(self, structure: HitStructure) -> None:
        assert structure.drives is not None
        self._data = data = structure.drives
        self._inert = 2.0 / _STEP * data.inertia
        self._link = data.damping + 0.5 * _STEP * data.stiffness  # gear's force by speed in a step
        self._share = self._link / (self._inert + self._link)
        self._servo = data.speed_gain + 0.5 * _STEP * data.position_gain
        self._least = -structure.limit - structure.torque
        self._most = structure.limit - structure.torque
        self.resists = self._share * self._inert

    def start(self, run_up: Array, switch: Switch) -> None:
        """Begin a hit with the joints' speeds in the run-up [rad/s]."""
        zero = np.zeros(len(run_up))
        self._place, self._speed, self._gear = zero, zero, zero
        time = _STEP * (np.arange(round(_LONGEST / _STEP)) + 0.5) - switch.delay
        part = np.clip(time / max(switch.slow_down, _STEP), 0.0, 1.0)
        lost = 1.0 - switch.ratio
        slowing = max(switch.slow_down, _STEP)
        self._rate = -0.5 * lost * (1.0 - np.cos(np.pi * part))
        self._lag = -0.5 * lost * slowing * (part - np.sin(np.pi * part) / np.pi)
        self._lag -= lost * np.maximum(time - slowing, 0.0)
        self._run_up = run_up

    def push(self, number: int, joint: Array) -> Array:
        """Compute the torques on joints (J,) [rad] that keep their place in a step, (J,) [N m]."""
        data = self._data
        wind = data.stiffness * (self._place - joint)
        error = self._lag[number] * self._run_up - self._place
        wanted = data.position_gain * error + data.speed_gain * self._rate[number] * self._run_up
        ahead = (self._inert * self._speed + wanted - self._gear) / (self._inert + self._servo)
        motor = np.minimum(np.maximum(wanted - self._servo * ahead, self._least), self._most)
        self._motor, self._wind = motor, wind
        self._right = self._inert * self._speed + motor - wind
        return np.asarray(wind + self._share * self._right)

    def advance(self, joint_speed: Array) -> tuple[Array, Array]:
        """End a step with the joints' speeds in its middle; return torques of gears and motors."""
        middle = (self._right + self._link * joint_speed) / (self._inert + self._link)
        self._gear = self._wind + self._link * (middle - joint_speed)
        self._place = self._place + _STEP * middle
        self._speed = 2.0 * middle - self._speed
        return self._gear, self._motor

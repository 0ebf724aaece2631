"""The simulated world: HRP-2 in front of a swing door, stepped by control ticks of 5 ms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from door_model.config import DoorConfig
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.contact import ContactDesign, design_contact, reduced_mass
from hrp2_sim_bridge.door_world import DoorBody, DoorState
from hrp2_sim_bridge.driver import TrajectoryDriver
from hrp2_sim_bridge.engine import connect, prepare
from hrp2_sim_bridge.errors import SettingError
from hrp2_sim_bridge.recorder import save_npz
from hrp2_sim_bridge.robot_world import SIDES, BodyState, RobotBody, rotation
from hrp2_sim_bridge.sensors import EncoderCounter, ImuSample, TickSample, imu_sample
from hrp2_sim_bridge.settings import SAMPLE, SAMPLES_PER_TICK, TICK, WorldSettings
from hrp2_sim_bridge.spline import Array
from hrp2_sim_bridge.trajectory import JointLimits
from hrp2_sim_bridge.truth_log import Touch, TruthLog

CONTACT_FORCE = 5.0  # above it robot and door touch [N]
_NEAR = 0.08  # robot closer to the leaf than this: fine steps [m]
_SETTLING_TICKS = 40  # before time 0, for the soles to carry the weight
_CONTACT_DURATION = 0.015  # of the impact the leaf's surface is designed for [s]
_CONTACT_MASS = 47.0  # free mass at point B it is designed for [kg]
_FALLEN_TILT = math.radians(30.0)
_NO_TOUCH = Touch(0.0, -1, np.zeros(3))


class World:
    """HRP-2 standing in half-sitting before a closed door; time is 0 once it stands.

    Args:
        robot: configuration.
        door: configuration.
        door_distance: of the leaf's face from the origin, to -y [m].
        hinge_x: place of the hinge, negative behind the robot [m].
        posture: (30,) at the start [rad]; half-sitting by default.
        settings: fields of `WorldSettings`.

    Raises:
        SettingError: a setting out of its range.
        SimulatorMissingError: no PyBullet.
        ModelError: PyBullet did not take the robot as its URDF says.
    """

    def __init__(
        self,
        robot: RobotConfig,
        door: DoorConfig,
        door_distance: float,
        hinge_x: float,
        *,
        posture: Array | None = None,
        **settings: Any,
    ) -> None:
        self.robot_config = robot
        self.door_config = door
        self.settings = WorldSettings(**settings)
        self._check_place(door_distance, hinge_x)
        self._door_distance = door_distance
        self._hinge_x = hinge_x
        self._posture = np.array(robot.half_sitting if posture is None else posture, dtype=float)
        self.contact = self._design_contact()
        limits = JointLimits(robot.joint_names, robot.lower, robot.upper, robot.velocity_limit)
        self.driver = TrajectoryDriver(limits, self._posture, tick=TICK)
        self._log = TruthLog(self.settings.log_seconds)
        offset = np.random.default_rng(self.settings.seed).integers(1 << 16)
        self._encoder = EncoderCounter(int(offset), self.settings.encoder_bits)
        self._client: Any = None
        self.reset()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._ticks * TICK

    @property
    def door_state(self) -> DoorState:
        """True angle and angular velocity of the leaf."""
        return self.door.state()

    @property
    def fell(self) -> bool:
        """True once the base tilted by more than 30 deg or a body but the feet met the floor."""
        return bool(self.fall_reason)

    def reset(self) -> None:
        """Back to the start: the same state, bit for bit."""
        if self._client is not None and not self.settings.gui:
            self.close()
        if self._client is None:
            # A new physics server: nothing of the last run can be left in it.
            self._client = connect(self.settings.gui)
        settings = self.settings
        self._step_length = settings.time_step_coarse
        self._floor = prepare(
            self._client, self._step_length, settings.iterations, settings.friction
        )
        self.robot = RobotBody(
            self._client, self.robot_config, self._posture, brace=settings.brace
        )
        self.door = DoorBody(
            self._client, self.door_config, self._door_distance, self._hinge_x, self.contact
        )
        self.fall_reason = ""
        self.max_tilt = 0.0
        self.brace_impulse = dict.fromkeys(self.robot_config.braced_joints, 0.0)
        self._ticks = -_SETTLING_TICKS
        self.driver.reset(self._posture, self.time)
        self._remember_states()
        for _ in range(_SETTLING_TICKS):
            self.step()
        self._log.clear()
        self.brace_impulse = dict.fromkeys(self.robot_config.braced_joints, 0.0)

    def push_door(self, impulse: float, duration: float) -> None:
        """Push the door as a hand does, from now on.

        Args:
            impulse: angular impulse about the hinge [N m s], positive opens.
            duration: of the half sine of torque [s].

        Raises:
            SettingError: a duration that is not positive, or no number.
        """
        self.door.push(impulse, duration, self.time)

    def step(self) -> TickSample:
        """Advance by one control tick; returns what the sensors say at its end."""
        reference = self.driver.sample(self.time).position
        braced = self.robot.update_brace(reference)
        fine = self._choose_step()
        self._peak_torque = np.zeros(len(reference))
        wrenches = np.zeros((2, 6))
        counts = []
        for index in range(SAMPLES_PER_TICK):
            begin = self.time + index * SAMPLE
            wrenches += self._millisecond(begin) / SAMPLES_PER_TICK
            counts.append(self._encoder.count(self.door.state().angle))
        self._ticks += 1
        ahead = self.driver.sample(self.time).position
        self._log.add_tick(self.time, ahead, self._peak_torque, braced, fine)
        self._watch_fall()
        imu = self._read_imu()
        q, dq, torque = self._joints
        return TickSample(self.time, q, dq, torque, wrenches[0], wrenches[1], imu, tuple(counts))

    def log(self, *, with_com: bool = True) -> dict[str, Any]:
        """The truth so far.

        One row a millisecond (mean wrenches [N, N m] and contact force [N] over it, states at its
        end; frames: world, wrenches in the soles'), and one a tick for keys that begin with
        "tick_"; `contact_link` is an index into `link_names`, -1 for none.

        Args:
            with_com: add CoM position and velocity, which takes about 10 us a row.
        """
        log = self._log.arrays(self.robot_config, with_com=with_com)
        return log | {
            "link_names": np.array(self.robot.link_names),
            "brace_impulse": np.array(list(self.brace_impulse.values())),
            "door": self.door_config.name,
            "door_distance": self._door_distance,
            "hinge_x": self._hinge_x,
            "i_a": self.door_config.i_a,
            "restitution": self.contact.restitution,
            "contact_stiffness": self.contact.stiffness,
            "contact_damping": self.contact.damping,
            "fall_reason": self.fall_reason,
            "max_tilt": self.max_tilt,
        }

    def save_log(self, path: str | Path) -> Path:
        """Write `log` as an npz; returns its path."""
        return save_npz(path, self.log())

    def close(self) -> None:
        """Leave PyBullet."""
        if self._client is not None:
            self._client.disconnect()
            self._client = None

    def _check_place(self, door_distance: float, hinge_x: float) -> None:
        if not (math.isfinite(door_distance) and door_distance > 0.0):
            raise SettingError("door_distance", door_distance, "a positive number")
        if not math.isfinite(hinge_x):
            raise SettingError("hinge_x", hinge_x, "a finite number")

    def _design_contact(self) -> ContactDesign:
        """For a free mass that hits the leaf abreast of the origin, where the robot stands."""
        wanted = self.settings.restitution
        l_b = max(abs(self._hinge_x), 0.1)
        return design_contact(
            self.door_config.restitution if wanted is None else wanted,
            reduced_mass(_CONTACT_MASS, self.door_config.i_a / l_b**2),
            _CONTACT_DURATION,
            self.settings.time_step_fine,
        )

    def _remember_states(self) -> None:
        self._soles = {side: self.robot.frame(self.robot.soles[side]) for side in SIDES}
        self._imu_before = self.robot.imu()

    def _choose_step(self) -> bool:
        """Fine steps near the leaf: at 1 ms the solver fails robot and door together."""
        near = self._client.getClosestPoints(self.robot.body, self.door.body, _NEAR)
        fine = len(near) > 0
        settings = self.settings
        step = settings.time_step_fine if fine else settings.time_step_coarse
        if step != self._step_length:
            self._client.setTimeStep(step)
            self._step_length = step
        return fine

    def _millisecond(self, begin: float) -> Array:
        """One millisecond in substeps, logged; returns the mean foot wrenches (2, 6)."""
        step = self._step_length
        substeps = round(SAMPLE / step)
        reactions = np.zeros((2, 6))
        force, latest = 0.0, _NO_TOUCH
        reference = self.driver.sample(begin).position
        for index in range(substeps):
            now = begin + index * step
            ahead = self.driver.sample(now + step).position
            self.robot.command(reference, (ahead - reference) / step)
            reference = ahead
            self.door.apply_torque(now, step)
            self._client.stepSimulation()
            q, dq, torque, reaction = self.robot.read_joints()
            self._joints = (q, dq, torque)
            reactions += reaction / substeps
            np.maximum(self._peak_torque, np.abs(torque), out=self._peak_torque)
            touch = self._touch()
            if touch.force > CONTACT_FORCE:
                self._count_brace(torque, step)
            if touch.force > 0.0:
                force += touch.force / substeps
                latest = touch
        wrenches = self._wrenches(reactions)
        self._log.add_sample(
            begin + SAMPLE, self.robot, self.door.state(), self._soles, (q, dq), wrenches,
            Touch(force, latest.link, latest.point),
        )
        return wrenches

    def _touch(self) -> Touch:
        total, most, link, place = 0.0, 0.0, -1, _NO_TOUCH.point
        for contact in self._client.getContactPoints(self.robot.body, self.door.body):
            total += contact[9]
            if contact[9] > most:
                most, link, place = contact[9], contact[3], np.array(contact[6])
        return Touch(total, link, place)

    def _count_brace(self, torque: Array, step: float) -> None:
        limits = self.robot_config.effort_limit
        for name, index in zip(self.brace_impulse, self.robot.braced_indices, strict=True):
            self.brace_impulse[name] += max(
                0.0, float(abs(torque[index]) - limits[index]) * step
            )

    def _wrenches(self, reactions: Array) -> Array:
        wrenches = np.zeros((2, 6))
        for row, side in enumerate(SIDES):
            before = self._soles[side]
            after = self.robot.frame(self.robot.soles[side])
            wrenches[row] = self.robot.foot_wrench(side, reactions[row], before, after, SAMPLE)
            self._soles[side] = after
        return wrenches

    def _watch_fall(self) -> None:
        tilt = math.acos(float(np.clip(rotation(self.robot.base().quaternion)[2, 2], -1.0, 1.0)))
        self.max_tilt = max(self.max_tilt, tilt)
        if self.fall_reason:
            return
        if tilt > _FALLEN_TILT:
            self.fall_reason = f"base tilted by {math.degrees(tilt):.0f} deg"
        touchers = self.robot.floor_touchers(self._floor)
        if touchers:
            self.fall_reason = f"on the floor: {', '.join(sorted(touchers))}"

    def _read_imu(self) -> ImuSample:
        after: BodyState = self.robot.imu()
        sample = imu_sample(self._imu_before, after, TICK)
        self._imu_before = after
        return sample

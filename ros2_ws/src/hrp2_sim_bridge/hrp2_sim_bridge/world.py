"""The simulated world: HRP-2 in front of a swing door, stepped by control ticks of 5 ms."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.control.driver import TrajectoryDriver
from hrp2_sim_bridge.control.stabilizer import Stabilizer
from hrp2_sim_bridge.control.trajectory import JointLimits, TrajectoryArrays
from hrp2_sim_bridge.errors import TrajectoryRefusedError
from hrp2_sim_bridge.log.command_log import CommandLog, trajectory_content
from hrp2_sim_bridge.log.recorder import save_npz
from hrp2_sim_bridge.log.truth_log import TruthLog
from hrp2_sim_bridge.physics.contact import leaf_contact
from hrp2_sim_bridge.physics.door_body import DoorBody, DoorState
from hrp2_sim_bridge.physics.engine import connect, prepare
from hrp2_sim_bridge.physics.fall import FallWatch
from hrp2_sim_bridge.physics.hit_meter import HitMeter
from hrp2_sim_bridge.physics.robot_body import RobotBody
from hrp2_sim_bridge.sensors.readings import TickReadings
from hrp2_sim_bridge.sensors.sensors import EncoderCounter, RobotSensors, TickSample
from hrp2_sim_bridge.settings import SAMPLE, SAMPLES_PER_TICK, TICK, WorldSettings

_NEAR = 0.08  # robot closer to the leaf than this: fine steps [m]
_FASTEST_APPROACH = 4.0  # of robot and leaf [m/s]
_SETTLING_TICKS = 40  # before time 0, for the soles to carry the weight
_RUBBER_SETTLING_TICKS = 100  # rubber swings for a while
_IMU = 3  # place of the IMU among the links whose states are read
_FARTHEST = 10.0  # place of the door [m]
_FALLEN_TORQUE = 0.1  # share of the motors' torques that a fallen robot may use


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
        self.contact = leaf_contact(door, hinge_x, self.settings)
        limits = JointLimits(robot.joint_names, robot.lower, robot.upper, robot.velocity_limit)
        self.driver = TrajectoryDriver(limits, self._posture, tick=TICK)
        self._log = TruthLog(self.settings.log_seconds)
        self._orders = CommandLog()
        offset = np.random.default_rng(self.settings.seed).integers(1 << 16)
        self._encoder = EncoderCounter(int(offset), self.settings.encoder_bits)
        self._sensors = RobotSensors(robot, self.settings.sensors, self.settings.seed)
        self._stabilizer = Stabilizer(robot) if self.settings.stabilized else None
        self.client: Any = None
        self.reset()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._ticks * TICK

    @property
    def tick(self) -> int:
        """Control ticks since the start."""
        return self._ticks

    @property
    def door_state(self) -> DoorState:
        """True angle and angular velocity of the leaf."""
        return self._door_state

    @property
    def fell(self) -> bool:
        """True once the base tilted by more than 30 deg or a body but the feet met the floor."""
        return bool(self.fall.reason)

    def reset(self) -> None:
        """Back to the start: the same state, bit for bit."""
        if self.client is not None and not self.settings.gui:
            self.close()
        if self.client is None:
            # A new physics server: nothing of the last run can be left in it.
            self.client = connect(self.settings.gui)
        settings = self.settings
        self.time_step = settings.time_step_coarse
        self.floor = prepare(
            self.client, self.time_step, settings.iterations, settings.friction
        )
        self.robot = RobotBody(
            self.client, self.robot_config, self._posture, rotor_scale=settings.rotor_scale,
            servo_time_constant=settings.servo_time_constant, rubber=settings.rubber,
        )
        self.robot.servos.set_step(self.time_step)
        self.door = DoorBody(
            self.client, self.door_config, self._door_distance, self._hinge_x, self.contact
        )
        self.hit = HitMeter(self.client, self.robot, self.door, self.robot_config)
        self.fall = FallWatch()
        settling = _RUBBER_SETTLING_TICKS if settings.rubber else _SETTLING_TICKS
        self._ticks = -settling
        self._felt: TickSample | None = None
        if self._stabilizer is not None:
            self._stabilizer.reset()
        self.driver.reset(self._posture, self.time)
        self._joints = self.robot.read_joints()
        self._frames = self.robot.read_frames()
        self._door_state = self.door.state()
        self._far_until = self._ticks
        self._sensors.power_on(self._posture, self.robot.imu())
        for _ in range(settling):
            self.step()
        self._log.clear()
        self._orders.clear()
        self.hit.clear()

    def follow(self, trajectory: TrajectoryArrays, stamp: float) -> None:
        """Take a trajectory over, or refuse it whole; one without points means stop.

        Args:
            trajectory: of all joints.
            stamp: when its clock starts [s], 0 for now.

        Raises:
            TrajectoryRefusedError: what is wrong with it, or with the robot.
        """
        if self.fell and not trajectory.is_stop:
            raise TrajectoryRefusedError(
                "the robot has fallen and wants a reset", "", self.fall.reason, "a standing robot"
            )
        self.driver.accept(trajectory, stamp, self.time)
        numbers = 3 * len(trajectory.times) * len(trajectory.joint_names)
        content = trajectory_content(trajectory)
        self._orders.add(
            self.tick, "trajectory", numbers=numbers, trajectory=content, stamp=float(stamp)
        )

    def stop(self) -> None:
        """Brake every joint and hold still."""
        self.driver.stop(self.time)
        self._orders.add(self.tick, "stop")

    def push_door(self, impulse: float, duration: float) -> None:
        """Push the door as a hand does, from now on.

        Args:
            impulse: angular impulse about the hinge [N m s], positive opens.
            duration: of the half sine of torque [s].

        Raises:
            SettingError: a duration that is not positive, or no number.
        """
        self.door.push(impulse, duration, self.time)
        self._orders.add(self.tick, "push", impulse=float(impulse), duration=float(duration))

    def step(self) -> TickSample:
        """Advance by one control tick; returns what the sensors say at its end."""
        fine = self._choose_step()
        step = self.time_step
        per_sample = round(SAMPLE / step)
        steps = SAMPLES_PER_TICK * per_sample
        times: Array = np.array([self.time + step * index for index in range(steps + 1)])
        reference = self.driver.positions(times)
        if self._stabilizer is not None and self._felt is not None and not self.fell:
            self._stabilizer.update(self._felt, self.driver.sample)
            reference += self._stabilizer.offsets(times)
        braced = self.robot.servos.limit_torques(
            reference[0], brace=self.settings.brace and fine and not self.fell,
            share=_FALLEN_TORQUE if self.fell else 1.0,
        )
        self.robot.hold_rotors(braced)
        targets = self.robot.servos.within_speed(reference, self._joints[0], step)
        speeds = (targets[1:] - targets[:-1]) / step
        readings = TickReadings([self._frames])
        orders = list(zip(targets.tolist(), speeds.tolist(), strict=False))
        for first in range(0, len(orders), per_sample):
            self._steps(orders[first : first + per_sample], times[first], readings, fine)
            self._read(readings, braced)
        self._ticks += 1
        self._log.add(readings, self.time, reference[-1], braced=braced, fine=fine)
        if self.fall.update(self.robot, self.floor):
            self.driver.stop(self.time)
        ends = readings.ends(self.robot)
        self._felt = self._sensors.read(
            self.time, self._joints, readings.wrenches(self.robot, ends, TICK),
            ends.at((1, _IMU)), [self._encoder.count(state.angle) for state in readings.door],
        )
        return self._felt

    def log(self, *, with_com: bool = True) -> dict[str, Any]:
        """The truth so far.

        One row a millisecond (mean wrenches [N, N m] and contact force [N] over it, states at its
        end; frames: world, wrenches in the soles'), and one a tick for keys that begin with
        "tick_"; `contact_link` is an index into `link_names`, -1 for none.

        Args:
            with_com: add CoM position and velocity, which takes about 10 us a row.
        """
        log = self._log.arrays(self.robot, with_com=with_com)
        return log | {
            "link_names": np.array(self.robot.link_names),
            "brace_impulse": self.hit.brace_impulse,
            "carried_impulse": self.hit.carried_impulse,
            "motor_impulse": self.hit.motor_impulse,
            "door": self.door_config.name,
            "door_distance": self._door_distance,
            "hinge_x": self._hinge_x,
            "i_a": self.door_config.i_a,
            "restitution": self.contact.restitution,
            "contact_stiffness": self.contact.stiffness,
            "contact_damping": self.contact.damping,
            "fall_reason": self.fall.reason,
            "max_tilt": self.fall.max_tilt,
            "ticks": self._ticks,
            "commands": self._orders.text(),
            "settings": json.dumps(asdict(self.settings)),
        }

    def save_log(self, path: str | Path) -> Path:
        """Write `log` as an npz; returns its path."""
        return save_npz(path, self.log())

    def close(self) -> None:
        """Leave PyBullet."""
        if self.client is not None:
            self.client.disconnect()
            self.client = None

    def _check_place(self, door_distance: float, hinge_x: float) -> None:
        if not 0.0 < door_distance <= _FARTHEST:
            raise SettingError("door_distance", door_distance, f"above 0, up to {_FARTHEST:g} m")
        if not abs(hinge_x) <= _FARTHEST:
            raise SettingError("hinge_x", hinge_x, f"within {_FARTHEST:g} m of the origin")

    def _choose_step(self) -> bool:
        """Fine steps near the leaf, where robot and door become one problem for the solver."""
        if self._ticks < self._far_until:
            return False
        points = self.client.getClosestPoints(self.robot.body, self.door.body, 2.0 * _NEAR)
        distance = min((point[8] for point in points), default=2.0 * _NEAR)
        fine = distance < _NEAR
        # Nothing crosses the rest of the way any sooner.
        self._far_until = self._ticks + int((distance - _NEAR) / (_FASTEST_APPROACH * TICK))
        settings = self.settings
        step = settings.time_step_fine if fine else settings.time_step_coarse
        if step != self.time_step:
            self.client.setTimeStep(step)
            self.robot.servos.set_step(step)
            self.time_step = step
        return fine

    def _steps(
        self, orders: list[tuple[list[float], list[float]]], now: float, readings: TickReadings,
        near: bool,
    ) -> None:
        """Take the physics steps of a millisecond, one for each order to the servos."""
        torque = self.door.torque(self._door_state, now, SAMPLE)
        reactions = []
        for position, speed in orders:
            self.robot.servos.command(position, speed)
            self.door.turn(torque)
            self.client.stepSimulation()
            reactions.append(self.robot.read_reactions())
            if near:
                self.hit.add_step(1.0 / len(orders))
        readings.reactions.append(np.array(reactions).mean(axis=0))

    def _read(self, readings: TickReadings, braced: bool) -> None:
        """Take readings at the end of a millisecond."""
        self._joints = self.robot.read_joints()
        self._frames = self.robot.read_frames()
        self._door_state = self.door.state()
        readings.joints.append(self._joints)
        readings.frames.append(self._frames)
        readings.door.append(self._door_state)
        readings.touches.append(self.hit.take(self._joints[2], braced=braced))

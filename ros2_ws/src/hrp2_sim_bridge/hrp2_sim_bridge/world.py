"""The simulated world: HRP-2 in front of a swing door, stepped by control ticks of 5 ms."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig
from hrp2_description.robot import RobotConfig
from humanoid_motion.driver_interface import Driver, TickSample, TrajectoryArrays

from hrp2_sim_bridge.control.actuation import Actuation
from hrp2_sim_bridge.control.driver import TrajectoryDriver
from hrp2_sim_bridge.control.stabilizer import Stabilizer
from hrp2_sim_bridge.control.trajectory import JointLimits
from hrp2_sim_bridge.errors import TrajectoryRefusedError
from hrp2_sim_bridge.log.command_log import CommandLog, trajectory_content
from hrp2_sim_bridge.log.recorder import save_npz
from hrp2_sim_bridge.log.truth_log import TruthLog
from hrp2_sim_bridge.physics.contact import design_leaf
from hrp2_sim_bridge.physics.door_load import DoorLoad
from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.engines import make_engine
from hrp2_sim_bridge.physics.fall import FallWatch
from hrp2_sim_bridge.physics.hit_meter import HitMeter
from hrp2_sim_bridge.physics.pushes import RobotPushes
from hrp2_sim_bridge.physics.scene import Scene, require_place
from hrp2_sim_bridge.physics.states import IMU, BodyState, DoorState, Reactions
from hrp2_sim_bridge.sensors.readings import TickReadings
from hrp2_sim_bridge.sensors.sensors import EncoderCounter, RobotSensors
from hrp2_sim_bridge.settings import SAMPLE, SAMPLES_PER_TICK, TICK, WorldSettings

_NEAR = 0.08  # distance between robot and leaf below which the physics steps are fine [m]
_FASTEST = 4.0  # upper bound of the speed at which the robot and a resting leaf approach [m/s]
_SETTLING_TICKS = 40  # ticks before time 0, in which the soles begin to carry the weight
_RUBBER_SETTLING_TICKS = 140  # the same for rubber soles, on which the robot swings for a while


class World(Driver):
    """HRP-2 standing in half-sitting and a closed door; time is 0 when the robot has settled.

    Args:
        robot: Configuration of the robot.
        door: Configuration of the door.
        door_distance: Distance of the leaf's face from the origin, towards -y [m].
        hinge_x: x of the hinge; it is negative behind the robot [m].
        posture: Joint angles at the start, (30,) [rad]; the default is half-sitting.
        engine: One of `settings.ENGINES`, of which a new engine is made, or an engine.
        settings: Other fields of `WorldSettings`.

    Attributes:
        robot_config: Configuration of the robot.
        door_config: Configuration of the door.
        settings: Settings of the simulation.
        contact: Surface of the leaf.
        engine: Physics engine.
        driver: Reference of the joints.
        joints: Motors and gears of the joints, and the brace of the arm.
        door: Closer, friction, stops and pushes of the door.
        pushes: Pushes on the robot.
        hit: Meter of the contact between robot and leaf.
        fall: Watch for a fall of the robot.
        time_step: Present length of a physics step [s].
        wall_time: Wall time that all ticks have needed since the world was made [s].
        observers: Functions that are called with the engine after each physics step.

    Raises:
        SettingError: A setting is out of its range.
        SimulatorMissingError: The physics engine is not installed.
        ModelError: The physics engine refused the robot or changed a mass or an inertia of it.
        RobotConfigError: The robot's configuration lacks something that the simulation needs.
    """

    def __init__(
        self,
        robot: RobotConfig,
        door: DoorConfig,
        door_distance: float,
        hinge_x: float,
        *,
        posture: Array | None = None,
        engine: Engine | str = WorldSettings.engine,
        **settings: Any,
    ) -> None:
        self.robot_config = robot
        self.door_config = door
        name = engine if isinstance(engine, str) else engine.name
        self.settings = WorldSettings(engine=name, **settings)
        self._posture = np.array(robot.half_sitting if posture is None else posture, dtype=float)
        require_place(door_distance, hinge_x)
        self.contact = design_leaf(door, hinge_x, self.settings)
        self._scene = Scene(
            robot, self._posture, door, door_distance, hinge_x, self.contact, self.settings)
        limits = JointLimits(robot.joint_names, robot.lower, robot.upper, robot.velocity_limit)
        self.driver = TrajectoryDriver(limits, self._posture, tick=TICK)
        self.engine = make_engine(engine) if isinstance(engine, str) else engine
        kept = self.settings.log
        self._log = TruthLog(self.settings.log_seconds, self.engine.frame_values) if kept else None
        self._orders = CommandLog(kept=kept)
        offset = np.random.default_rng(self.settings.seed).integers(1 << 16)
        self._encoder = EncoderCounter(int(offset), self.settings.encoder_bits)
        self._sensors = RobotSensors(robot, self.settings.sensors, self.settings.seed)
        self._stabilizer = Stabilizer(robot) if self.settings.stabilized else None
        self.wall_time = 0.0
        self.observers: list[Callable[[Engine], None]] = []
        self.reset()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._ticks * TICK

    @property
    def tick(self) -> int:
        """Number of control ticks since time 0."""
        return self._ticks

    @property
    def door_state(self) -> DoorState:
        """True angle and angular velocity of the leaf."""
        return self._door_state

    @property
    def imu_state(self) -> BodyState:
        """True pose and velocity of the IMU's frame."""
        return self.engine.link_states(np.array([self._frames])).at((0, IMU))

    @property
    def fell(self) -> bool:
        """Whether the base tilted by more than 30 deg or another link than a sole met the floor."""
        return bool(self.fall.reason)

    def reset(self) -> None:
        """Return to the start; a later run with the same orders is the same, bit for bit."""
        settings = self.settings
        self.time_step = settings.time_step_coarse
        self.engine.reset(self._scene)
        self.joints = Actuation(self.engine, self.robot_config, settings, self._posture)
        self.door = DoorLoad(self.door_config)
        self.pushes = RobotPushes(self.engine)
        self.hit = HitMeter(self.engine)
        self.fall = FallWatch({foot.sole for foot in self.robot_config.feet.values()})
        settling = _RUBBER_SETTLING_TICKS if settings.rubber else _SETTLING_TICKS
        self._ticks = -settling
        self._sensed: TickSample | None = None
        if self._stabilizer is not None:
            self._stabilizer.reset()
        self.driver.reset(self._posture, self.time)
        self._frames = self.engine.read_frames()
        self._hands = self.engine.hand_states()
        self._door_state = self.engine.door_state()
        self._same_until, self._fine = self._ticks, False
        self._sensors.power_on(self._posture, self.imu_state)
        for _ in range(settling):
            self.step()
        if self._log is not None:
            self._log.clear()
        self._orders.clear()

    def follow(self, trajectory: TrajectoryArrays, stamp: float) -> None:
        """Accept a trajectory or refuse it as a whole; one without points means stop.

        Args:
            trajectory: Trajectory of all joints.
            stamp: Time at which its clock starts [s]; 0 means now.

        Raises:
            TrajectoryRefusedError: The trajectory violates a limit, or the robot has fallen.
        """
        if self.fell and not trajectory.is_stop:
            raise TrajectoryRefusedError(
                "the robot has fallen and must be reset", "", self.fall.reason, "a standing robot"
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
        """Push the door by hand, beginning now.

        Args:
            impulse: Angular impulse about the hinge [N m s]; a positive one opens the door.
            duration: Duration of the push, whose torque is half a sine [s].

        Raises:
            SettingError: It is not a number, or with others that act more than a hand can do.
        """
        self.door.push(impulse, duration, self.time, self._door_state)
        self._orders.add(self.tick, "push", impulse=float(impulse), duration=float(duration))

    def push_robot(self, impulse: Array, duration: float = 0.1) -> None:
        """Push the robot's center of mass with a constant force, beginning now.

        Args:
            impulse: Impulse in the world, (3,) [N s].
            duration: Duration of the push [s].

        Raises:
            SettingError: It is not finite, or too strong together with others that act.
        """
        self.pushes.add(impulse, duration, self.time)
        self._orders.add(
            self.tick, "push_robot", impulse=[*map(float, impulse)], duration=float(duration))

    def step(self) -> TickSample:
        """Advance by one control tick; return what the sensors measured by its end."""
        begin = perf_counter()
        sample = self._step()
        self.wall_time += perf_counter() - begin
        return sample

    def log(self, *, with_com: bool = True) -> dict[str, Any]:
        """Return the true states since time 0.

        A column has one row for each millisecond: mean wrenches [N, N m] in the soles' frames and
        mean contact force [N] over it, and states at its end in the world. Columns whose names
        begin with "tick_" have one row for each tick. `contact_link` is an index into `link_names`,
        -1 without contact.

        Args:
            with_com: Whether to add position and velocity of the CoM, which costs about 10 us for
                each row.

        Raises:
            SettingError: The world was made without a log.
        """
        if self._log is None:
            raise SettingError("log", False, "True where the log is read")
        log = self._log.arrays(self.engine, self.robot_config, with_com=with_com)
        return log | {
            "link_names": np.array(self.engine.link_names),
            "door": self.door_config.name,
            "door_distance": self._scene.door_distance,
            "hinge_x": self._scene.hinge_x,
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
        """Write `log` to a file with the suffix npz; return its path.

        Raises:
            SettingError: The world was made without a log.
            OutputError: The file cannot be written.
        """
        return save_npz(path, self.log())

    def close(self) -> None:
        """Release the physics engine; the log remains readable."""
        self.engine.close()

    def _step(self) -> TickSample:
        fine = self._choose_step()
        step = self.time_step
        per_sample = round(SAMPLE / step)
        steps = SAMPLES_PER_TICK * per_sample
        times = self.time + step * np.arange(steps + 1, dtype=float)
        reference = self.driver.positions(times)
        if self._stabilizer is not None and self._sensed is not None and not self.fell:
            self._stabilizer.update(self._sensed, self.driver.sample)
            reference += self._stabilizer.offsets(times)
        locked = self.joints.begin_tick(reference[0], step, near=fine, fell=self.fell)
        speeds = (reference[1:] - reference[:-1]) / step
        readings = TickReadings([self._frames])
        orders = list(zip(reference[1:], speeds, strict=True))
        for first in range(0, len(orders), per_sample):
            self._take_steps(
                orders[first : first + per_sample], times[first], readings, near=fine
            )
            self._read(readings, last=first + per_sample == steps)
        self._ticks += 1
        if self._log is not None:
            self._log.add(
                readings, self.joints, self.time, reference[-1], locked=locked, fine=fine)
        if self.fall.update(self.engine):
            self.driver.stop(self.time)
        ends = readings.ends(self.engine)
        hands, self._hands = self._hands, self.engine.hand_states()
        self._sensed = self._sensors.read(
            self.time, self.joints.motors,
            readings.wrenches(self.engine, ends, [hands, self._hands], TICK), ends.at((1, IMU)),
            [self._encoder.count(state.angle) for state in readings.door])
        return self._sensed

    def _choose_step(self) -> bool:
        """Choose the length of the physics steps; return True if they are fine.

        They are fine near the leaf, where the solver treats robot and door as one problem.
        """
        if self._ticks < self._same_until and not self.door.pushed:
            return self._fine
        distance = self.engine.leaf_distance(2.0 * _NEAR)
        self._fine = fine = distance < _NEAR
        # Before this tick nothing can cover the distance to the limit, from either side of it.
        fastest = _FASTEST + self.door_config.leaf.width * abs(self._door_state.velocity)
        self._same_until = self._ticks + int(abs(distance - _NEAR) / (fastest * TICK))
        settings = self.settings
        step = settings.time_step_fine if fine else settings.time_step_coarse
        if step != self.time_step:
            self.engine.set_time_step(step)
            self.time_step = step
        return fine

    def _take_steps(
        self, orders: list[tuple[Array, Array]], now: float, readings: TickReadings, *, near: bool
    ) -> None:
        """Take the physics steps of a millisecond, one for each order to the servos."""
        torque = self.door.torque(self._door_state, now, SAMPLE)
        self.pushes.act(now, SAMPLE)
        self.joints.begin_sample()
        reactions: list[Reactions] = []
        watched = near and self._log is not None
        for position, speed in orders:
            reactions.append(self.joints.step(position, speed, torque))
            for observer in self.observers:
                observer(self.engine)
            if watched:
                self.hit.add_step(1.0 / len(orders))
        readings.reactions.append(reactions)

    def _read(self, readings: TickReadings, *, last: bool) -> None:
        """Add the readings at the end of a millisecond, the last one of the tick or another."""
        self._door_state = self.engine.door_state()
        readings.door.append(self._door_state)
        readings.touches.append(self.hit.take())
        if last or self._log is not None:
            self._frames = self.engine.read_frames()
            readings.frames.append(self._frames)
        if self._log is not None:
            readings.joints.append(self.joints.joints)

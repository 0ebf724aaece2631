"""The simulated world: a robot in front of a swing door, stepped by control ticks of 5 ms."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.documents import checked
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig
from door_model.door.geometry import along
from hrp2_description.robot import RobotConfig
from humanoid_motion.driver_interface import Driver, TickSample, TrajectoryArrays
from humanoid_motion.mirror import Mirror
from robot_driver.errors import TrajectoryRefusedError
from robot_driver.trajectory_checks import JointLimits
from robot_driver.trajectory_driver import TrajectoryDriver

from hrp2_sim_bridge.control.drives import Actuation
from hrp2_sim_bridge.control.hand_compliance import HandCompliance
from hrp2_sim_bridge.control.servo import Servo
from hrp2_sim_bridge.control.stabilizer import Stabilizer
from hrp2_sim_bridge.log import TruthLog, save_npz
from hrp2_sim_bridge.physics.contact import design_leaf
from hrp2_sim_bridge.physics.door_load import DoorLoad
from hrp2_sim_bridge.physics.engine import (
    DoorState,
    Engine,
    Reactions,
    Scene,
    Touch,
    require_place,
    require_simulable,
    sensed_links,
)
from hrp2_sim_bridge.physics.engines import make_engine
from hrp2_sim_bridge.physics.kinematics import Kinematics, LinkStates, sensed_bodies
from hrp2_sim_bridge.physics.robot_loads import FallWatch, HitMeter, RobotPushes
from hrp2_sim_bridge.sensors.sensors import EncoderCounter, RobotSensors, outer_wrenches
from hrp2_sim_bridge.settings import SAMPLE, SAMPLES_PER_TICK, TICK, WorldSettings

_NEAR = 0.08  # distance between robot and leaf below which the physics steps are fine [m]
_FASTEST = 4.0  # upper bound of the speed at which the robot and a resting leaf approach [m/s]
_SETTLING_TICKS = 40  # ticks before time 0, in which the soles begin to carry the weight
_RUBBER_SETTLING_TICKS = 140  # the same for rubber soles, on which the robot swings for a while


@dataclass
class _Readings:
    """Readings of a tick, one for each millisecond; without a log, base and joints of its end.

    Attributes:
        reactions: Forces and torques at the force sensors in each physics step.
        door: State of the leaf.
        touches: Contact between robot and leaf.
        frame_force: Mean of the normal forces of frame and wall on the robot, summed [N].
        base: Rows of `Engine.read_base`.
        joints: Positions [rad] and velocities [rad/s] of the joints, (2, J).
        torque: Largest torques of the motors at these times, (J,) [N m].
    """

    reactions: list[list[Reactions]] = field(default_factory=list)
    door: list[DoorState] = field(default_factory=list)
    touches: list[Touch] = field(default_factory=list)
    frame_force: list[float] = field(default_factory=list)
    base: list[list[float]] = field(default_factory=list)
    joints: list[Array] = field(default_factory=list)
    torque: Array | float = 0.0


class World(Driver):
    """A robot standing in half-sitting and a closed door; time is 0 when the robot has settled.

    Args:
        robot: Configuration of the robot.
        door: Configuration of the door.
        door_distance: Distance of the leaf's face from the origin, towards -y [m].
        hinge_x: x of a hinge at the right, negative behind the robot; -x of one at the left [m].
        posture: Joint angles at the start, (J,) [rad]; the default is half-sitting.
        engine: One of `settings.ENGINES`, of which a new engine is made, or an engine.
        settings: Other fields of `WorldSettings`.

    Attributes:
        contact: Surface of the leaf.
        driver: Reference of the joints.
        hands: Compliance of the hands.
        joints: Motors and gears of the joints, and the brace of the arm.
        door: Closer, friction, stops and pushes of the door.
        pushes: Pushes on the robot.
        hit: Meter of the contact between robot and leaf.
        fall: Watch for a fall of the robot.
        links: States of soles, hands with force sensors, and IMU after the last tick.
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
        if door.hinge == "left":
            robot = Mirror(robot).left_armed(robot)
        self.door_config = door
        name = engine if isinstance(engine, str) else engine.name
        self.settings = checked(WorldSettings, {"engine": name, **settings})
        self.robot_config = robot = require_simulable(robot, self.settings)
        self._posture = np.array(robot.half_sitting if posture is None else posture, dtype=float)
        require_place(door_distance, hinge_x)
        self.contact = design_leaf(door, hinge_x, self.settings)
        self._scene = Scene(
            robot, self._posture, door, door_distance, along(door.hinge) * hinge_x, self.contact,
            self.settings)
        limits = JointLimits.of(robot)
        self.driver: TrajectoryDriver | Servo = (
            Servo(limits, self._posture, self.settings.playback_delay) if self.settings.servo
            else TrajectoryDriver(limits, self._posture))
        self.engine = make_engine(engine) if isinstance(engine, str) else engine
        self._log = (TruthLog(self.settings.log_seconds, len(robot.joint_names))
                     if self.settings.log else None)
        self._bodies = sensed_bodies(robot)
        self._kinematics = Kinematics(robot, [*sensed_links(robot), robot.imu_frame])
        offset = np.random.default_rng(self.settings.seed).integers(1 << 16)
        self._encoder = EncoderCounter(int(offset), self.settings.encoder_bits)
        self._sensors = RobotSensors(robot, self.settings.sensors, self.settings.seed)
        self._stabilizer = Stabilizer(robot) if self.settings.stabilized else None
        self.hands = HandCompliance(robot)
        self.wall_time = 0.0
        self.observers: list[Callable[[Engine], None]] = []
        self.reset()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._ticks * TICK

    @property
    def commanded(self) -> Array:
        """Posture that the driver commands now, (J,) [rad]."""
        return np.asarray(self.driver.sample(self.time).position)

    @property
    def door_state(self) -> DoorState:
        """True angle and angular velocity of the leaf."""
        return self._door_state

    @property
    def imu_state(self) -> LinkStates:
        """True pose and velocity of the IMU's frame."""
        return self.links.at(-1)

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
        self.door = DoorLoad(self.door_config, settings.opens_to)
        self.pushes = RobotPushes(self.engine)
        self.hit = HitMeter(self.engine)
        self.fall = FallWatch({foot.sole for foot in self.robot_config.feet.values()})
        settling = _RUBBER_SETTLING_TICKS if settings.rubber else _SETTLING_TICKS
        self._ticks = -settling
        self._sensed: TickSample | None = None
        if self._stabilizer is not None:
            self._stabilizer.reset()
        self.hands.reset()
        self.driver.reset(self._posture, self.time)
        self._base = self.engine.base_states(np.array([self.engine.read_base()]))
        self.links = self._link_states()
        self._door_state = self.engine.door_state()
        self._same_until, self._fine = self._ticks, False
        self._sensors.power_on(self._posture, self.imu_state)
        for _ in range(settling):
            self.step()
        if self._log is not None:
            self._log.clear()

    def follow(self, trajectory: TrajectoryArrays, stamp: float) -> None:
        """Accept a trajectory of all joints or refuse it as a whole; one without points means stop.

        Its clock starts at the stamp [s]; 0 means now.

        Raises:
            TrajectoryRefusedError: The trajectory violates a limit, or the robot has fallen.
        """
        if self.fell and not trajectory.is_stop:
            raise TrajectoryRefusedError(
                "the robot has fallen and must be reset", "", self.fall.reason, "a standing robot")
        self.driver.accept(trajectory, stamp, self.time)

    def stop(self) -> None:
        """Brake every joint and hold still."""
        self.driver.stop(self.time)

    def comply(
        self, side: str, stiffness: float = -1.0, damping: float = -1.0, mass: float = -1.0
    ) -> None:
        """Let a hand yield to the force that its wrist measures, beginning now, or refuse.

        Arguments and errors are those of `HandCompliance.comply`. After a reset hands are stiff.
        """
        self.hands.comply(side, stiffness, damping, mass)

    def push_door(self, impulse: float, duration: float) -> None:
        """Push the door by hand, beginning now.

        Args:
            impulse: Angular impulse about the hinge [N m s]; a positive one opens the door.
            duration: Duration of the push, whose torque is half a sine [s].

        Raises:
            SettingError: It is not a number, or with others that act more than a hand can do.
        """
        self.door.push(impulse, duration, self.time, self._door_state)

    def push_robot(self, impulse: Array, duration: float = 0.1) -> None:
        """Push the robot's center of mass with a constant force, beginning now.

        The impulse is in the world, (3,) [N s]; the duration is in [s].

        Raises:
            SettingError: It is not finite, or too strong together with others that act.
        """
        self.pushes.add(impulse, duration, self.time)

    def step(self) -> TickSample:
        """Advance by one control tick; return what the sensors measured by its end."""
        begin = perf_counter()
        sample = self._step()
        self.wall_time += perf_counter() - begin
        return sample

    def log(self) -> dict[str, Any]:
        """Return the true states since time 0, and what is needed to read them.

        A column has one row for each millisecond: mean wrenches [N, N m] in the soles' frames and
        mean contact force [N] over it, and states at its end in the world. Columns whose names
        begin with "tick_" have one row for each tick. `contact_link` is an index into `link_names`,
        -1 without contact. `frame_force` is the mean normal force of frame and wall [N].

        Raises:
            SettingError: The world was made without a log.
        """
        if self._log is None:
            raise SettingError("log", False, "True where the log is read")
        return self._log.arrays(self.engine, self.robot_config) | {
            "link_names": np.array(self.engine.link_names),
            "door": self.door_config.name,
            "hinge": self.door_config.hinge,
            "door_distance": self._scene.door_distance,
            "hinge_x": self._scene.hinge_x,
            "i_a": self.door_config.i_a,
            "restitution": self.contact.restitution,
            "contact_stiffness": self.contact.stiffness,
            "contact_damping": self.contact.damping,
            "fall_reason": self.fall.reason,
            "max_tilt": self.fall.max_tilt,
            "settings": json.dumps(asdict(self.settings))}

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
        steps = round(TICK / step)
        times = self.time + step * np.arange(steps + 1, dtype=float)
        reference = self.driver.positions(times)
        if self._sensed is not None and self.hands.active:
            if not self.fell:  # a fallen robot keeps the displacement that it has
                self.hands.update(self._sensed, self.driver.sample)
            reference += self.hands.offsets(times)
        if self._stabilizer is not None and self._sensed is not None and not self.fell:
            self._stabilizer.update(self._sensed, self.driver.sample, self.hands.load)
            reference += self._stabilizer.offsets(times)
        locked = self.joints.begin_tick(reference[0], step, near=fine, fell=self.fell)
        orders = np.stack([reference[1:], (reference[1:] - reference[:-1]) / step], axis=1)
        readings = _Readings()
        for part in np.split(orders, SAMPLES_PER_TICK):
            self._take_steps(list(part), readings, near=fine)
        self._ticks += 1
        reactions = np.array(readings.reactions).mean(axis=1)
        if self._log is None:
            readings.base.append(self.engine.read_base())
        else:
            self._log.add_samples(
                self.time, readings.joints, readings.base, reactions, readings.door,
                readings.touches, readings.frame_force)
            self._log.add_tick(
                self.time, reference[-1], np.asarray(readings.torque), self.joints, locked=locked,
                fine=fine)
        self._base = self.engine.base_states(np.array(readings.base[-1:]))
        if self.fall.update(self.engine, self._base[0]):
            self.driver.stop(self.time)
        before, self.links = self.links, self._link_states()
        bodies = slice(len(self._bodies.mass))
        wrenches = outer_wrenches(
            reactions.mean(axis=0), before.at(bodies), self.links.at(bodies), TICK,
            self._bodies)
        self._sensed = self._sensors.read(
            self.time, self.joints.motors, wrenches, self.imu_state,
            [self._encoder.count(state.angle) for state in readings.door])
        return self._sensed

    def _link_states(self) -> LinkStates:
        """Return the states of the soles, the hands with force sensors, and the IMU."""
        return self._kinematics.states(self._base, self.joints.state[None])[0].at(0)

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

    def _take_steps(self, orders: list[Array], readings: _Readings, *, near: bool) -> None:
        """Take the physics steps of a millisecond, one for each order to the servos."""
        now = self.time + SAMPLE * len(readings.door)
        torque = self.door.torque(self._door_state, now, SAMPLE)
        self.pushes.act(now, SAMPLE)
        self.joints.begin_sample()
        reactions: list[Reactions] = []
        watched, scraped = near and self._log is not None, 0.0
        for order in orders:
            reactions.append(self.joints.step(order, torque))
            for observer in self.observers:
                observer(self.engine)
            if watched:
                self.hit.add_step(1.0 / len(orders))
            if self._log is not None:
                scraped += self.engine.frame_force()
        self._door_state = self.engine.door_state()
        readings.reactions.append(reactions)
        readings.door.append(self._door_state)
        if self._log is not None:
            readings.touches.append(self.hit.take())
            readings.frame_force.append(scraped / len(orders))
            readings.base.append(self.engine.read_base())
            readings.joints.append(self.joints.state)
            readings.torque = np.maximum(readings.torque, np.abs(self.joints.drives.motor))

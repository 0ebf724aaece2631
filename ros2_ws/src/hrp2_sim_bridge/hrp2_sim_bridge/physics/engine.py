"""The interface of a physics engine, the scene that it builds, and the states that it reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, cast

from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig
from door_model.door.frame import FixedBox, frame_boxes
from door_model.door.geometry import before
from hrp2_description.drives_and_pads import Drives, SoleRubber
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import SIDES, RobotConfig

from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.settings import FARTHEST, WorldSettings

# Forces [N] and torques [N m] on what is beyond force sensors, in frames of `sensed_links`, (B, 6):
# left and right sole; left and right hand, if the wrists have sensors.
Reactions = Sequence[Sequence[float]]


def require_place(door_distance: float, hinge_x: float) -> None:
    """Check the place of a door, both in [m].

    Raises:
        SettingError: The door is too far from the origin, or behind it.
    """
    if not 0.0 < door_distance <= FARTHEST:
        raise SettingError("door_distance", door_distance, f"above 0, up to {FARTHEST:g} m")
    if not abs(hinge_x) <= FARTHEST:
        raise SettingError("hinge_x", hinge_x, f"within {FARTHEST:g} m of the origin")


class SimulatedRobot(RobotConfig):
    """What the type checker knows of a robot that `require_simulable` has let pass."""

    feet: Mapping[str, Any]  # each has a sensor_joint
    drives: Drives
    motor_encoder_counts: int
    imu_frame: str
    sole_rubber: SoleRubber  # read where the settings have rubber


def require_simulable(robot: RobotConfig, settings: WorldSettings) -> SimulatedRobot:
    """Return a robot whose configuration has what the simulation needs beyond a plan.

    Raises:
        RobotConfigError: It lacks fields, which are named.
    """
    names = ["drives", "motor_encoder_counts", "imu_frame", *["sole_rubber"] * settings.rubber]
    lacking = [name for name in names if getattr(robot, name) is None]
    lacking += [f"feet.{side}.sensor_joint" for side in SIDES
                if robot.feet[side].sensor_joint is None]
    if lacking:
        raise RobotConfigError(
            f"{robot.name} cannot be simulated without fields of its robot.yaml", value=lacking,
            limit="these fields, as in hrp2_description/config/robot.yaml")
    return cast(SimulatedRobot, robot)


@dataclass(frozen=True)
class Scene:
    """Robot and door in their first state; `require_place` checks the door's place.

    The soles stand on the floor, and the middle between them is `start`. The face of the closed
    leaf lies in the plane y = -door_distance, and the leaf opens towards -y.

    Attributes:
        robot: Configuration of the robot.
        posture: Joint angles at the start, (J,) [rad].
        door: Configuration of the door.
        door_distance: Distance of the leaf's face from the world's origin [m].
        hinge_x: x of the hinge [m].
        contact: Surface of the leaf.
        settings: Settings of the simulation.
    """

    robot: SimulatedRobot
    posture: Array
    door: DoorConfig
    door_distance: float
    hinge_x: float
    contact: ContactDesign
    settings: WorldSettings

    @property
    def frame_boxes(self) -> list[FixedBox]:
        """Wall, jamb, lintel and threshold in the world; none where the door has no frame."""
        door = self.door
        if door.frame is None:
            return []
        return frame_boxes(
            door.leaf, door.frame, (self.hinge_x, -self.door_distance, 0.0), door.hinge)

    @property
    def start(self) -> tuple[float, float, float]:
        """`settings.start` as it is before this door: x [m], y [m] and heading [rad] in odom."""
        return before(self.door.hinge, self.settings.start)

    @property
    def sole_rubber(self) -> SoleRubber | None:
        """Rubber under each sole; None for rigid soles."""
        if not self.settings.rubber:
            return None
        known = self.robot.sole_rubber
        return replace(known, stiffness=self.settings.rubber_scale * known.stiffness)


def sensed_links(robot: RobotConfig) -> list[str]:
    """Return the links beyond force sensors: soles, and hands if their wrists have sensors."""
    wrists = robot.wrist_sensors
    hands = [] if wrists is None else [wrists[side].link for side in SIDES]
    return [*(robot.feet[side].sole for side in SIDES), *hands]


def sensor_joints(robot: SimulatedRobot) -> list[str]:
    """Return the fixed joints in which the force sensors of `sensed_links` are."""
    wrists = robot.wrist_sensors
    return [*(robot.feet[side].sensor_joint for side in SIDES),
            *([] if wrists is None else [wrists[side].joint for side in SIDES])]


class DoorState(NamedTuple):
    """Angle [rad] and angular velocity [rad/s] of the leaf, positive when it opens."""

    angle: float
    velocity: float


class Touch(NamedTuple):
    """Contact between robot and leaf.

    Attributes:
        force: Sum of the normal forces [N].
        link: Index of the link with the largest force, -1 without contact.
        point: Point in the world at which that link touches the leaf, (3,) [m].
    """

    force: float
    link: int
    point: Sequence[float]


NO_TOUCH = Touch(0.0, -1, (0.0, 0.0, 0.0))


class FloorContact(NamedTuple):
    """Contact between a link of the robot and the floor or a threshold.

    Attributes:
        link: Name of the link.
        point: Point of the contact in the world, (3,) [m].
        force: Normal force of the floor in the world, (3,) [N].
        distance: Distance of the link from the floor [m]; positive where they do not touch yet.
    """

    link: str
    point: Sequence[float]
    force: Sequence[float]
    distance: float


class Engine(Protocol):
    """Robot, door with frame, and floor in a physics engine, in the world's axes; first `reset`."""

    name: str  # one of `settings.ENGINES`
    link_names: tuple[str, ...]
    stepping_time: float  # wall time that the engine itself needed for its steps [s]

    def reset(self, scene: Scene) -> None:
        """Build a scene in its first state; nothing of an earlier run remains."""

    def set_time_step(self, step: float) -> None:
        """Set the length of the coming physics steps [s]."""

    def hold(self, joints: Sequence[int]) -> None:
        """Lock these joints where they are, whatever their torques, and release all others."""

    def push_robot(self, force: Array) -> None:
        """Push the robot with a force (3,) [N] in all coming steps, shared by the links' masses."""

    def step(self, torque: Array, door_torque: float) -> Reactions:
        """Step with torques on the joints (J,) and on the leaf [N m]."""

    def joint_state(self) -> Array:
        """Return joint positions [rad] and velocities [rad/s] after the last step, (2, J)."""

    def read_base(self) -> list[float]:
        """Return 13 numbers of the base after the last step, of which `base_states` makes states.

        Raises:
            DivergedError: One of them is not finite.
        """

    def base_states(self, rows: Array) -> Array:
        """Return states of base_link in the world from T rows of `read_base`.

        Returns:
            Position [m], quaternion x, y, z, w, velocity of the origin [m/s] and angular velocity
            [rad/s], (T, 13).
        """

    def door_state(self) -> DoorState:
        """Return the leaf's angle and angular velocity."""

    def leaf_distance(self, most: float) -> float:
        """Return the distance between robot and leaf, at most `most` [m]."""

    def touch(self) -> Touch:
        """Return the contact between robot and leaf after the last step."""

    def frame_force(self) -> float:
        """Return the normal forces of frame and wall on the robot after the last step, summed [N].

        The threshold does not belong to them: it is a floor.
        """

    def floor_contacts(self) -> list[FloorContact]:
        """Return the contacts between robot and floor or threshold after the last step."""

    def close(self) -> None:
        """Release the engine; `base_states` still works."""

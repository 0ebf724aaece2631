"""The interface that a physics engine offers to the world; `engines.py` names the engines."""

from typing import Protocol

from door_impact_common.arrays import Array

from hrp2_sim_bridge.physics.scene import Scene
from hrp2_sim_bridge.physics.states import BodyState, DoorState, FloorContact, Reactions, Touch


class Engine(Protocol):
    """Robot, door and floor in a physics engine, in the world's frame; `reset` comes first."""
    name: str  # one of `settings.ENGINES`
    link_names: tuple[str, ...]
    sensed_mass: Array  # masses (B,) beyond the force sensors, in the order of `Reactions` [kg]
    sensed_inertia: Array  # principal moments of these bodies in their axes, (B, 3) [kg m^2]
    frame_values: int  # length of a row of `read_frames`
    stepping_time: float  # wall time that the engine itself needed for its steps [s]

    def reset(self, scene: Scene) -> None:
        """Build a scene in its first state; nothing of an earlier run remains."""

    def set_time_step(self, step: float) -> None:
        """Set the length of the coming physics steps [s]."""

    def hold(self, joints: list[int]) -> None:
        """Lock these joints where they are, whatever their torques, and release all others."""

    def push_robot(self, force: Array) -> None:
        """Push the robot with a force (3,) [N] in all coming steps, shared by the links' masses."""

    def step(self, torque: Array, door_torque: float) -> Reactions:
        """Step with torques on the joints (30,) and on the leaf [N m]."""

    def joint_state(self) -> Array:
        """Return joint positions [rad] and velocities [rad/s] after the last step, (2, 30)."""

    def read_frames(self) -> list[float]:
        """Return a row of numbers, of which `link_states` and `base_states` make states."""

    def link_states(self, rows: Array) -> BodyState:
        """Return states (T, 4) of left sole, right sole, contact link and IMU from T rows."""

    def hand_states(self) -> BodyState:
        """Return states (B - 2,) of the hands beyond force sensors after the last step."""

    def base_states(self, rows: Array) -> BodyState:
        """Return states (T,) of base_link from T rows of `read_frames`."""

    def tilt(self) -> float:
        """Return the angle between base_link's z axis and the vertical [rad]."""

    def door_state(self) -> DoorState:
        """Return the leaf's angle and angular velocity."""

    def leaf_distance(self, most: float) -> float:
        """Return the distance between robot and leaf, at most `most` [m]."""

    def touch(self) -> Touch:
        """Return the contact between robot and leaf after the last step."""

    def floor_contacts(self) -> list[FloorContact]:
        """Return the contacts between robot and floor after the last step."""

    def close(self) -> None:
        """Release the engine; `link_states` and `base_states` still work."""

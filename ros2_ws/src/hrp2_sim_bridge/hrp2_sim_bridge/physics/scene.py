"""The scene that a physics engine builds: HRP-2 on a floor, in front of a swing door."""

from __future__ import annotations

from dataclasses import dataclass, replace

from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig
from hrp2_description.robot import RobotConfig, SoleRubber, needed

from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.settings import FARTHEST, WorldSettings


def require_place(door_distance: float, hinge_x: float) -> None:
    """Check the place of a door, both in [m].

    Raises:
        SettingError: The door is too far from the origin, or behind it.
    """
    if not 0.0 < door_distance <= FARTHEST:
        raise SettingError("door_distance", door_distance, f"above 0, up to {FARTHEST:g} m")
    if not abs(hinge_x) <= FARTHEST:
        raise SettingError("hinge_x", hinge_x, f"within {FARTHEST:g} m of the origin")


@dataclass(frozen=True)
class Scene:
    """Robot and door in their first state.

    The soles stand on the floor, and the middle between them is `settings.start`. The face of the
    closed leaf lies in the plane y = -door_distance, and the leaf opens towards -y.

    Attributes:
        robot: Configuration of the robot.
        posture: Joint angles at the start, (30,) [rad].
        door: Configuration of the door.
        door_distance: Distance of the leaf's face from the world's origin [m].
        hinge_x: x of the hinge; it is negative behind the robot [m].
        contact: Surface of the leaf.
        settings: Settings of the simulation.

    Raises:
        SettingError: The door is too far from the origin, or behind it.
    """

    robot: RobotConfig
    posture: Array
    door: DoorConfig
    door_distance: float
    hinge_x: float
    contact: ContactDesign
    settings: WorldSettings

    def __post_init__(self) -> None:
        """Check the door's place."""
        require_place(self.door_distance, self.hinge_x)

    @property
    def sole_rubber(self) -> SoleRubber | None:
        """Rubber under each sole; None for rigid soles.

        Raises:
            RobotConfigError: The robot's configuration has no rubber.
        """
        if not self.settings.rubber:
            return None
        known = needed(self.robot.sole_rubber, "sole_rubber")
        return replace(known, stiffness=self.settings.rubber_scale * known.stiffness)

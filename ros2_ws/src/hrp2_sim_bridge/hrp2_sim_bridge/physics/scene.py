"""The scene that a physics engine builds: HRP-2 on a floor, in front of a swing door."""

from __future__ import annotations

from dataclasses import dataclass

from door_impact_common.arrays import Array
from door_model.door.config import DoorConfig
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.settings import WorldSettings


@dataclass(frozen=True)
class Scene:
    """Robot and door in their first state.

    The soles stand on the floor and the world's origin lies midway between them. The face of the
    closed leaf lies in the plane y = -door_distance, and the leaf opens towards -y.

    Attributes:
        robot: Configuration of the robot.
        posture: Joint angles at the start, (30,) [rad].
        door: Configuration of the door.
        door_distance: Distance of the leaf's face from the world's origin [m].
        hinge_x: x of the hinge; it is negative behind the robot [m].
        contact: Surface of the leaf.
        settings: Settings of the simulation.
    """

    robot: RobotConfig
    posture: Array
    door: DoorConfig
    door_distance: float
    hinge_x: float
    contact: ContactDesign
    settings: WorldSettings

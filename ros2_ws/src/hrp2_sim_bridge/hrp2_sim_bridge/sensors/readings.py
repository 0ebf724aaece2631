"""What PyBullet said in a control tick, millisecond by millisecond."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES

from hrp2_sim_bridge.physics.door_body import DoorState
from hrp2_sim_bridge.physics.frames import BodyState
from hrp2_sim_bridge.physics.hit_meter import Touch
from hrp2_sim_bridge.physics.robot_body import RobotBody
from hrp2_sim_bridge.sensors.foot_wrench import foot_wrenches


@dataclass
class TickReadings:
    """Readings at the ends of milliseconds, in the form that costs least.

    Attributes:
        frames: `RobotBody.read_frames` at the start of the tick, then after each millisecond.
        joints: `RobotBody.read_joints` after each.
        reactions: (2, 6) mean of `RobotBody.read_reactions` over its physics steps.
        door: state of the leaf.
        touches: contact of robot and leaf.
    """

    frames: list[list[float]]
    joints: list[Array] = field(default_factory=list)
    reactions: list[Array] = field(default_factory=list)
    door: list[DoorState] = field(default_factory=list)
    touches: list[Touch] = field(default_factory=list)

    def ends(self, robot: RobotBody) -> BodyState:
        """States (2, 4) of the links of `RobotBody.link_states` before and after the tick."""
        return robot.link_states(np.array([self.frames[0], self.frames[-1]]))

    def wrenches(self, robot: RobotBody, ends: BodyState, duration: float) -> Array:
        """Mean wrench of the floor on both soles over the tick (2, 6), in the soles' frames."""
        mean = np.array(self.reactions).mean(axis=0)
        soles = ends.at((slice(None), slice(len(SIDES))))
        return foot_wrenches(
            mean[None], soles, duration, robot.sole_mass, robot.sole_inertia
        )[0]

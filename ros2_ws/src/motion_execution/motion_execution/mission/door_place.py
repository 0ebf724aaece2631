"""Where the door stands, as a mission knows it."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from humanoid_motion.clearance import bodies_of
from humanoid_motion.robot_model import RobotModel
from walking.errors import BadDoorPose
from walking.footsteps.footstep import Pose
from walking.passing.approach import Site, hit_start
from walking.passing.doorway import Doorway
from walking.passing.surroundings import Surroundings

from motion_execution.mission.link import Link


class DoorPlace:
    """The place of the door, told by messages or as it was surveyed.

    Args:
        robot: The robot.
        link: What is told.
        survey: The door as it is to be seen from where a hit begins.

    Attributes:
        survey: The door as it is to be seen from where a hit begins.
    """

    def __init__(self, robot: RobotModel, link: Link, survey: Pose) -> None:
        self._robot, self._link, self.survey = robot, link, survey

    def told(self) -> Pose | None:
        """Return the door's pose in odom as somebody tells it; errors as of `Link.door_pose`."""
        return self._link.door_pose(-self.survey.x)

    def pose(self) -> Pose:
        """Return the door's pose in odom; errors are those of `Link.door_pose`."""
        return self.told() or self.survey

    def site(self) -> Site:
        """Return where a hit is to begin; errors are those of `Link.door_pose`."""
        told = self.told()
        return Site(hit_start(told or self.survey, self.survey), certain=told is None)

    def around(self) -> Surroundings | None:
        """Return what a walk must know of the door; None where its place is not known.

        A leaf whose angle is not measured counts as shut.
        """
        known = self._link.door
        with suppress(BadDoorPose):
            pose = self.pose()
            if known is not None and known.frame is not None and np.isfinite(pose).all():
                angle = np.nan_to_num(self._link.inputs.door_angle)
                return Surroundings(Doorway(np.zeros(2), *known.frame), pose, float(angle),
                                    bodies_of(self._robot).seen_from_above())
        return None

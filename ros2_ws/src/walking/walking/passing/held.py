"""The robot with its hand on the leaf: from what was planned and what is measured to a task."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_model.door.door import Door
from humanoid_motion.tolerances import WALK_START

from walking.errors import NotReady
from walking.footsteps.footstep import ORIGIN, Footstep, Pose, Stance
from walking.passing.doorway import Doorway
from walking.passing.passage_task import PassageTask

HITS = tuple(
    (math.radians(deg), ending) for ending, angles in (
        ("pass", (25.0, 30.0, 35.0, 40.0)), ("hold", (25.0, 30.0, 35.0, 40.0, 45.0)))
    for deg in angles)
"""Opening angles [rad] and endings of a hit, tried until a passage can be planned from its end.

With `pass` the leaf stays where the hand has caught it, which takes 2 s less. From there the first
step may be too long for a leg, which the pushed back leaf of `hold` leaves nearer to the feet. A
leaf that was hit farther is caught harder, up to where the arm no longer follows.
"""
_MOVED = 0.05  # largest distance of the soles from where the hit was planned to leave them [m]
_TURNED = math.radians(5.0)  # and of their heading [rad]
_AJAR = math.radians(3.0)  # angle below which a leaf is not held open [rad]


@dataclass(frozen=True)
class Hold:
    """How a hit, or the hand's way to the closed leaf, is planned to end, and in which axes.

    Attributes:
        door: Dynamics of the door.
        doorway: Leaf and wall.
        angle: Opening angle at which the hand holds the leaf; 0: it is closed [rad].
        stance: The soles.
        joints: Joints of the robot, (J,) [rad].
        axes: Pose in odom of the axes in which doorway and stance are, along the closed leaf.
    """

    door: Door
    doorway: Doorway
    angle: float
    stance: Stance
    joints: Array
    axes: Pose = ORIGIN

    def in_odom(self, footsteps: Sequence[Footstep]) -> list[Footstep]:
        """Return footsteps of the passage in odom."""
        return [Footstep(step.side, *self.axes.moved(*step.pose), step.duration)
                for step in footsteps]

    def task(self) -> PassageTask:
        """Return the passage from the planned end."""
        return PassageTask(self.door, self.doorway, self.angle, self.stance, self.joints)

    def found(
        self, joints: Array, soles: Stance, angle: float, commanded: Array | None = None,
        attitude: Array | None = None,
    ) -> PassageTask:
        """Return the passage from where the robot has come to.

        Motors never hold a posture exactly. The passage begins from the posture that they were
        commanded to, on the soles' places by the odometry, so that the driver's reference goes on
        without a jump.

        Args:
            joints: Measured joints, (J,) [rad].
            soles: The soles by the odometry.
            angle: Measured angle of the leaf [rad].
            commanded: Posture in which the last trajectory ends, (J,) [rad]: a leaf that stood
                elsewhere than planned makes it another one than the plan's. None, and
                one that the robot is not in, stand for the plan's.
            attitude: Measured orientation of the IMU as a quaternion x, y, z, w, (4,); None takes
                the robot as upright.

        Raises:
            NotReady: The robot does not stand where and as planned, or the leaf is not open that
                should be.
        """
        holds = self.joints
        if commanded is not None and np.abs(joints - commanded).max() <= WALK_START:
            holds = commanded
        off = float(np.abs(joints - holds).max())
        if not off <= WALK_START:
            raise NotReady(
                f"the robot does not hold the leaf: a joint is {off:.3f} rad from the planned "
                f"posture, at most {WALK_START} rad are allowed",
                quantity="joint [rad]", value=off, limit=WALK_START)
        middle, planned = soles.middle.seen_from(self.axes), self.stance.middle
        x, y, yaw = middle.seen_from(planned)
        if not (math.hypot(x, y) <= _MOVED and abs(yaw) <= _TURNED):
            raise NotReady(
                f"the soles are {math.hypot(x, y):.3f} m and {math.degrees(yaw):.1f} deg from "
                f"where they were planned, at most {_MOVED} m and {math.degrees(_TURNED):g} deg "
                "are allowed", quantity="soles [m]", value=math.hypot(x, y), limit=_MOVED)
        if self.angle > 0.0 and not angle >= _AJAR:
            raise NotReady(
                f"the leaf stands at {math.degrees(angle):.1f} deg: nobody holds it open",
                quantity="leaf angle [rad]", value=angle, limit=_AJAR)
        stance = Stance(*(middle.moved(*foot.seen_from(planned))
                          for foot in (self.stance.left, self.stance.right)))
        return PassageTask(
            self.door, self.doorway, max(0.0, angle), stance, holds, joints, attitude)

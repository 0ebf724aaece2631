"""Walks up to the door for the node door_passer, by the survey or by /door_pose."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from door_impact_common.node import GuardedNode, until
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import seconds
from door_impact_msgs.action import Walk
from geometry_msgs.msg import PoseWithCovarianceStamped
from walking.errors import BadDoorPose, InvalidFootsteps, NotReached, Stopped
from walking.footsteps.footstep import Pose
from walking.passing.approach import (
    NEAR,
    SURVEYED,
    Site,
    arrived,
    hit_start,
    require_arrived,
    require_found,
    require_way,
    within,
)

from motion_execution.ros.clients import MotionClient
from motion_execution.ros.messages import ODOM, floor_pose, stamped
from motion_execution.ros.walking_robot import WalkingRobot

WALK, DOOR_POSE = "/walk", "/door_pose"
PARAMETERS = {  # without a default: params.yaml of the bringup sets them for every node
    "door_distance": (math.nan, "surveyed distance of the closed leaf's face from where a hit "
                      "begins [m]"),
    "hinge_x": (math.nan, "surveyed x of the hinge, seen from there [m]"),
}
_OLDEST = 5.0  # largest age of a message on /door_pose when a goal arrives [s]
_REST = 1.0  # time in which a robot on rubber soles comes to rest after a walk [s]
_ROWS = np.ix_((0, 1, 5), (0, 1, 5))  # of x, y and the turn about z in a message's covariance


class WalkUp:
    """Knows where a hit begins, and walks there.

    Args:
        node: Node that calls /walk and hears of the door.
        body: The robot.

    Attributes:
        survey: The door as it is to be seen from where a hit begins.
    """

    def __init__(self, node: GuardedNode, body: WalkingRobot) -> None:
        given = Parameters(node, PARAMETERS)
        self._node, self._body, self._now = node, body, body.topics.now
        self.survey = Pose(given.number("hinge_x"), -given.number("door_distance"), 0.0)
        self._walks = MotionClient(node, Walk, WALK, "walker")
        self._told: Any = None  # last message on /door_pose
        node.create_subscription(PoseWithCovarianceStamped, DOOR_POSE, self._on_pose, 10)

    def cancel(self) -> None:
        """Cancel a walk that is under way."""
        self._walks.cancel()

    def site(self) -> Site:
        """Return where a hit is to begin.

        Raises:
            BadDoorPose: /door_pose makes no sense, is too old or too uncertain.
        """
        age = 0.0 if self._told is None else self._now() - seconds(self._told.header.stamp)
        if not abs(age) <= _OLDEST:
            raise BadDoorPose(quantity=f"age of {DOOR_POSE} [s]", value=round(age, 1),
                              limit=f"at most {_OLDEST:g}")
        return Site(hit_start(self._door(), self.survey), certain=self._told is None)

    def require_reachable(self, site: Site, walk_up: bool) -> None:
        """Check that the robot stands where a hit is to begin, or can and may walk there.

        Raises:
            NotReady: Messages are missing or old.
            NotReached: It stands elsewhere, and may not walk.
            BadDoorPose: It is too far away, or not on the side from which it pushes.
        """
        middle = self._middle()
        if not walk_up:
            require_arrived(middle, site.axes)
        elif not within(middle, site.axes, NEAR):
            require_way(middle, site.axes, self._door())

    async def arrive(
        self, site: Site, ahead: float, goal: Any, goal_id: Any, stopped: Callable[[], bool],
        on_feedback: Callable[[Any], None],
    ) -> Site:
        """Walk to where a hit begins, unless the robot stands there, and see the door from there.

        Args:
            site: Where it is to begin.
            ahead: Distance of B ahead of the soles at the hit [m].
            goal: The goal of /walk_through_door.
            goal_id: Its identifier.
            stopped: Whether the robot is not to go on.
            on_feedback: Function that gets each feedback of the walk.

        Returns:
            The site as it is found; that of the argument where the robot stands as surveyed, and
            after a dry run of a walk.

        Raises:
            DoorImpactError: The robot has not got there.
        """
        walks = not within(self._middle(), site.axes, NEAR)
        if walks:
            place = stamped(self._body.turned(site.axes), self._node.get_clock().now().to_msg())
            done = await self._walks.execute(
                Walk.Goal(goal=place, dry_run=goal.dry_run), goal_id, on_feedback, stopped)
            if stopped():
                raise Stopped(f"the robot was stopped before the hit: {done.message}")
            if not done.success:
                raise NotReached(f"the robot has not got to the door: {done.message}",
                                 reason="fell" if done.error_code == Walk.Result.FELL else "")
            if goal.dry_run:
                return site
            rested = self._now() + _REST
            await until(self._node, lambda: self._now() >= rested, 10.0 * _REST)
        axes, middle = hit_start(self._door(), self.survey), self._middle()
        certain = self._told is None and not walks
        if certain and within(middle, axes, SURVEYED):
            return site
        return arrived(axes, middle, self.survey, ahead, certain=certain)

    def _middle(self) -> Pose:
        """Return the middle between the soles; errors are those of `WalkingRobot.standing`."""
        self._body.standing()
        soles = self._body.soles()
        assert soles is not None
        return soles.middle

    def _door(self) -> Pose:
        """Return where the door stands; errors are those of `door_pose`."""
        if self._told is None:
            return self.survey
        return self._body.turned(door_pose(self._told, -self.survey.x))

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        self._told = message


def door_pose(message: PoseWithCovarianceStamped, along: float) -> Pose:
    """Read a door's pose in odom.

    Args:
        message: The message.
        along: Distance from the hinge at which the leaf is touched [m].

    Raises:
        BadDoorPose: The pose is in another frame, tilted, no number, or too uncertain.
    """
    frame = message.header.frame_id
    if frame.lstrip("/") != ODOM:
        raise BadDoorPose(quantity=f"frame of {DOOR_POSE}", value=frame, limit=ODOM)
    try:
        pose = floor_pose(message.pose.pose, DOOR_POSE)
    except InvalidFootsteps as error:
        raise BadDoorPose(str(error), quantity=error.quantity, value=error.value) from error
    covariance = np.reshape(message.pose.covariance, (6, 6))
    require_found(covariance[_ROWS], pose.yaw, along)
    return pose

"""The robot as a mission knows it, and the one motion that it makes at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.support import polygon_margin, support_polygon
from humanoid_motion.driver_interface import Command
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.tolerances import STILL
from robot_driver.errors import TrajectoryRefusedError
from robot_driver.motion import Motion
from robot_driver.names import IMU, JOINTS
from robot_driver.trajectory_checks import JointLimits
from robot_driver.trajectory_guard import TrajectoryGuard
from walking.errors import NotReady
from walking.footsteps.footstep import Stance

from motion_execution.judge import fell
from motion_execution.mission.link import Link
from motion_execution.mission.order import Order
from motion_execution.mission.routine import Condition, until
from motion_execution.settings import ExecutionSettings
from motion_execution.walk.start import Standing, soles_at
from motion_execution.walk.stepping import Stepping

PATIENCE = 3.0  # time that a goal waits for messages, by a steady clock [s]
STANDING = (JOINTS, IMU)  # topics without which no motion can go on
_OLDEST = 0.5  # largest difference between the stamps of odometry and joints [s]


class Body:
    """What is known of the robot, and how it is moved.

    Args:
        model: The robot.
        link: Messages to and from it.

    Attributes:
        model: The robot.
        motion: The present motion; None outside one.
        idle: What gets the messages outside a motion; None: nobody.
        commanded: Where the last trajectory ends, (J,) [rad]; None before the first.
    """

    def __init__(self, model: RobotModel, link: Link) -> None:
        self.model, self._link = model, link
        self.inputs = link.inputs
        self.motion: Motion | None = None
        self.idle: Motion | None = None
        self.commanded: Array | None = None
        self._guard = TrajectoryGuard(JointLimits.of(model.config))

    # -- measurements ---------------------------------------------------------------------------

    def heard(self, topics: Sequence[str] = STANDING) -> bool:
        """Return whether enough messages of topics and of the odometry have arrived."""
        return self.inputs.complete(topics) and self.soles() is not None

    def soles(self) -> Stance | None:
        """Return the soles by the odometry; None without recent messages."""
        base, joints = self._link.base(), self.inputs.joints
        if base is None or joints is None or abs(base[0] - joints[0]) > _OLDEST:
            return None
        return soles_at(self.model, base[1], joints[1], self.attitude)

    @property
    def attitude(self) -> Array | None:
        """Last orientation of the IMU as a quaternion x, y, z, w, (4,); None: not known."""
        return self.inputs.recent[-1].imu.orientation if self.inputs.recent else None

    def standing(self, topics: Sequence[str] = STANDING) -> Standing:
        """Return what is known of a robot that stands, if messages of topics arrive.

        Raises:
            NotReady: Messages are missing or old.
        """
        self.require_messages(topics)
        base, joints = self._link.base(), self.inputs.joints
        if base is None or joints is None or self.soles() is None:
            raise NotReady("no recent odometry has arrived on /tf (odom -> "
                           f"{self.model.config.root_link}): does zmp_publisher run?",
                           quantity="/tf", value=None)
        return Standing(base[1], self.inputs.tilt, joints[1], joints[2], self.attitude)

    def require_messages(self, topics: Sequence[str]) -> None:
        """Check that the robot is upright, and that messages of topics arrive and make sense.

        Raises:
            NotReady: It lies, or messages are missing or old, or contradict each other.
        """
        tilt = self.inputs.tilt
        # Before the sensors are judged, as those of a robot that stands.
        if why := fell(tilt, ExecutionSettings.fall_tilt):
            raise NotReady(why, quantity="tilt of the trunk [rad]", value=tilt)
        stale = self._link.refusal(topics)
        if stale is not None:
            raise NotReady(stale[0], quantity="age [s]", value=stale[1])

    def require_still(self, topics: Sequence[str]) -> Standing:
        """Return what is known of a robot at rest; errors as of `standing`, or a joint turns."""
        standing = self.standing(topics)
        fastest = float(np.abs(standing.velocity).max())
        if not fastest <= STILL:
            raise NotReady(f"a joint turns at {fastest:.2f} rad/s; a passage begins at rest, with "
                           f"at most {STILL:g} rad/s", quantity="speed [rad/s]", value=fastest,
                           limit=STILL)
        return standing

    def zmp_margin(self, sides: Sequence[str]) -> float:
        """Return the distance of the last ZMP from the edge of soles, by the odometry [m].

        Args:
            sides: Sides of the feet that should bear load.
        """
        zmp, soles = self._link.zmp(), self.soles()
        if zmp is None or soles is None:
            return math.nan
        corners = (self.model.feet[side].corners((*soles.foot(side)[:2], 0.0),
                                                 soles.foot(side).yaw) for side in sides)
        return float(polygon_margin(zmp[1], support_polygon(*corners)))

    def walk_margin(self, walk: Stepping, now: float) -> float:
        """Return `zmp_margin` of a walk; NaN if other soles should bear load at the last ZMP."""
        zmp, sides = self._link.zmp(), walk.phase(now).sides
        if zmp is None or walk.phase(zmp[0]).sides != sides:
            return math.nan
        return self.zmp_margin(sides)

    # -- motions --------------------------------------------------------------------------------

    def send(self, command: Command) -> None:
        """Send a trajectory to the driver, if the guard lets it pass; otherwise end the motion."""
        joints, now = self.inputs.joints, self._link.now()
        try:
            sent = self._guard.follow(command, now, None if joints is None else joints[1])
        except TrajectoryRefusedError as error:
            self.refused(f"a trajectory was refused: {error}")
            return
        if sent is None:
            return
        self._link.send(sent)
        assert sent.knots is not None
        self.commanded = sent.knots.position[-1]

    def brake(self) -> bool:
        """Brake what the driver still follows after a motion has ended; return whether it does."""
        moving = self._guard.moving(self._link.now())
        if moving:
            self.send(Command(0.0, None))
        return moving

    def follows(self, stamp: float, reference: Array) -> None:
        """Handle what the controller says that it follows, (J,) [rad], at a time [s].

        A motion ends where that is not what the controller was sent.
        """
        if why := self._guard.compare(stamp, reference):
            self.refused(why)

    def refused(self, why: str) -> None:
        """End the motion as safely as it can: the driver does not follow it, for a reason."""
        motion = self.motion or self.idle
        self._link.say(why, warning=True)
        for command in motion.on_refusal(self._link.now(), why) if motion is not None else ():
            self.send(command)

    def begin(
        self, order: Order, motion: Motion, command: Command, topics: Sequence[str] = STANDING
    ) -> None:
        """Begin a motion that somebody has asked for; it is the one that gets the messages.

        Args:
            order: What it is made for.
            motion: The motion.
            command: Its first command.
            topics: Topics without which it cannot go on.
        """
        self.inputs.needs(topics)
        self.inputs.intake.begin()
        self.inputs.motion = self.motion = order.motion = motion
        self.send(command)
        motion.prepare_next()

    async def ended(self, order: Order) -> None:
        """Wait for the end of the present motion, and say what was noticed in it."""
        motion = self.motion
        assert motion is not None
        await until(lambda: not motion.running)
        self.inputs.motion, self.motion, order.motion = self.idle, None, None
        self.inputs.needs(STANDING)
        for what, value in self.inputs.intake.noticed().items():
            self._link.say(f"noticed in the motion: {what}: {value}", warning=True)

    async def wait(self, condition: Condition, patience: float, order: Order) -> None:
        """Wait until a condition holds, at most for a time of a steady clock [s].

        Raises:
            Stopped: The order was taken back.
        """
        end = self._link.clock() + patience
        await until(lambda: condition() or order.stopped or self._link.clock() >= end)
        order.require()

    async def rest(self, duration: float, order: Order) -> None:
        """Wait for a time of the robot's clock [s]; `Stopped` as of `wait`."""
        rested = self._link.now() + duration
        await self.wait(lambda: self._link.now() >= rested, 10.0 * duration, order)

    async def caught_up(self, order: Order) -> None:
        """Wait until the messages that came in during a planning are handled."""
        await self.wait(lambda: self.inputs.lag == 0.0, PATIENCE, order)



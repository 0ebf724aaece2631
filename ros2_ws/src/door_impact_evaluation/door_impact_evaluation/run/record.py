"""Hold the measurements of a run as arrays, of which figures and summary are made."""

from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.mirror import Mirror, headings, orientations, places, wrenches
from numpy.typing import NDArray


@dataclass(frozen=True)
class Motion:
    """The simulation's own 1 kHz log. Only the evaluation reads it; the nodes never do.

    Attributes:
        t: Sample times (n,) [s].
        left_wrench: Force [N] and torque [N m] of the floor on the left sole, in l_sole (n, 6).
        right_wrench: Force [N] and torque [N m] of the floor on the right sole, in r_sole (n, 6).
        left_sole: Position of l_sole in odom (n, 3) [m].
        right_sole: Position of r_sole in odom (n, 3) [m].
        left_heading: Turn of l_sole about odom's z (n,) [rad].
        right_heading: Turn of r_sole about odom's z (n,) [rad].
        base_orientation: Orientation of base_link in odom, quaternions x, y, z, w (n, 4).
        door_angle: Opening angle of the door (n,) [rad].
        door_velocity: Angular velocity of the door, positive when it opens (n,) [rad/s].
        contact_force: Normal force of the robot on the door (n,) [N].
        point_b_velocity: Velocity of point B towards the door (n,) [m/s].
        joints: Joint angles (n, J) [rad].
        base_position: Position of base_link in odom (n, 3) [m].
        com: Position of the CoM in odom (n, 3) [m].
    """

    t: Array
    left_wrench: Array
    right_wrench: Array
    left_sole: Array
    right_sole: Array
    left_heading: Array
    right_heading: Array
    base_orientation: Array
    door_angle: Array
    door_velocity: Array
    contact_force: Array
    point_b_velocity: Array
    joints: Array
    base_position: Array
    com: Array

    def reflected(self, mirror: Mirror) -> "Motion":
        """Return the motion of the robot's mirror image, in which the feet change sides."""
        return replace(
            self, left_wrench=wrenches(self.right_wrench), right_wrench=wrenches(self.left_wrench),
            left_sole=places(self.right_sole), right_sole=places(self.left_sole),
            left_heading=headings(self.right_heading), right_heading=headings(self.left_heading),
            base_orientation=orientations(self.base_orientation),
            joints=mirror.joints(self.joints), base_position=places(self.base_position),
            com=places(self.com))


@dataclass(frozen=True)
class Support:
    """ZMP and support polygon at every sample of the log.

    Attributes:
        zmp: ZMP, x and y in odom (n, 2) [m]; NaN while the feet bear hardly any load.
        margin: Distance from the ZMP to the nearest edge of the support polygon, negative outside
            (n,) [m].
        low: Smallest -y of the support polygon in odom (n,) [m].
        high: Largest -y of the support polygon in odom, towards the door (n,) [m].
        polygons: The different support polygons, corners (K, 2) in odom [m]; the first one is
            empty.
        polygon: Index of each sample's polygon among them (n,).
    """

    zmp: Array
    margin: Array
    low: Array
    high: Array
    polygons: list[Array]
    polygon: NDArray[np.intp]

    def reflected(self) -> "Support":
        """Return what supports the robot's mirror image."""
        return replace(self, zmp=places(self.zmp), polygons=[*map(places, self.polygons)])


@dataclass(frozen=True)
class DemoRecord:
    """Everything that the figures of the motion need.

    Attributes:
        motion: The simulation's log.
        phases: Start and end of each phase [s], in order of time.
        contact_time: Time of the first contact of robot and door [s]; NaN without one.
        peak_time: Time of the door's largest angle after this contact [s]; NaN without one.
        support: ZMP of the 20 ms mean of the wrenches, and support polygon, at the motion's times.
        zmp_topic: Stamp, x and y of each message on /zmp, in odom (k, 3) [s, m, m].
        door_topic: Stamp and opening angle of each message on /door_angle (j, 2) [s, rad].
    """

    motion: Motion
    phases: dict[str, tuple[float, float]]
    contact_time: float
    peak_time: float
    support: Support
    zmp_topic: Array
    door_topic: Array

"""What the demonstration recorded, as arrays: the figures and the summary are made of these."""

from dataclasses import dataclass

from door_impact_common.arrays import Array


@dataclass(frozen=True)
class SwingFit:
    """A free swing of the door beside eq. (1) with the identified parameters.

    Attributes:
        t: Times (n,) [s].
        measured: Encoder angles (n,) [rad].
        fitted: Angles by eq. (1) (n,) [rad].
    """

    t: Array
    measured: Array
    fitted: Array


@dataclass(frozen=True)
class Motion:
    """The simulation's own 1 kHz log, for the evaluation only: no node sees it.

    Attributes:
        t: Times (n,) [s].
        left_wrench: Force [N] and torque [N m] of the floor on the left sole, in l_sole (n, 6).
        right_wrench: The same in r_sole (n, 6).
        left_sole: Position of l_sole in odom (n, 3) [m].
        right_sole: Position of r_sole in odom (n, 3) [m].
        base_orientation: Quaternions x, y, z, w of base_link in odom (n, 4).
        door_angle: (n,) [rad].
        door_velocity: (n,) [rad/s].
        contact_force: Normal force of the robot on the door (n,) [N].
        point_b_velocity: Velocity of point B towards the door (n,) [m/s].
        joints: Joint angles (n, 30) [rad].
        base_position: Of base_link in odom (n, 3) [m].
    """

    t: Array
    left_wrench: Array
    right_wrench: Array
    left_sole: Array
    right_sole: Array
    base_orientation: Array
    door_angle: Array
    door_velocity: Array
    contact_force: Array
    point_b_velocity: Array
    joints: Array
    base_position: Array


@dataclass(frozen=True)
class DemoRecord:
    """Everything that the figures of the motion need.

    Attributes:
        motion: The simulation's log.
        phases: Start and end of each phase [s], in order.
        contact_time: Of the first contact of robot and door [s].
        peak_time: Of the door's largest angle after it [s].
        zmp_t: Times of the evaluated ZMP (m,) [s].
        zmp_measured: ZMP of the 20 ms mean of the wrenches, x and y in odom (m, 2) [m].
        polygon_low: Smallest -y of the support polygon (m,) [m].
        polygon_high: Largest -y of the support polygon (m,) [m].
        zmp_topic_t: Stamps heard on /zmp (k,) [s].
        zmp_topic: /zmp, x and y in odom (k, 2) [m].
        door_topic_t: Stamps heard on /door_angle (j,) [s].
        door_topic: Angles heard on /door_angle (j,) [rad].
    """

    motion: Motion
    phases: dict[str, tuple[float, float]]
    contact_time: float
    peak_time: float
    zmp_t: Array
    zmp_measured: Array
    polygon_low: Array
    polygon_high: Array
    zmp_topic_t: Array
    zmp_topic: Array
    door_topic_t: Array
    door_topic: Array

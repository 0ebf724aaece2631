"""The interface of a robot's driver: simulation, kinematic double and hardware have it alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from door_impact_common.arrays import Array

from humanoid_motion.knots import Knots
from humanoid_motion.samples import ImuSample, Measured


@dataclass(frozen=True)
class TrajectoryArrays:
    """The content of a trajectory_msgs/JointTrajectory as sequences, unchecked.

    Attributes:
        joint_names: Names of the joints in the message's order.
        times: time_from_start of each point [s].
        positions: Positions of the joints, one sequence for each point [rad].
        velocities: Velocities in the same form [rad/s]; empty if the message has none.
        accelerations: Accelerations in the same form [rad/s^2]; empty if the message has none.
    """

    joint_names: Sequence[str]
    times: Sequence[float]
    positions: Sequence[Sequence[float]]
    velocities: Sequence[Sequence[float]] = ()
    accelerations: Sequence[Sequence[float]] = ()

    @classmethod
    def of(cls, command: Command, names: Sequence[str]) -> TrajectoryArrays:
        """Return the trajectory of a command, whose knots have columns of these joints."""
        knots = command.knots
        if knots is None:
            return cls((), (), ())
        return cls(names, knots.time.tolist(), knots.position.tolist(), knots.velocity.tolist(),
                   knots.acceleration.tolist())

    @property
    def is_stop(self) -> bool:
        """True for a trajectory without points, which means stop."""
        return len(self.times) == 0


@dataclass(frozen=True)
class TickSample:
    """All measurements at the end of a control tick; joints are in the robot's order.

    Attributes:
        time: Time at the end of the tick [s].
        position: Joint positions, (J,) [rad].
        velocity: Joint velocities, (J,) [rad/s].
        effort: Motor torques, (J,) [N m].
        left_wrench: Mean force and torque of the floor on the left sole over the tick, in the
            frame l_sole, (6,) [N, N m].
        right_wrench: Mean force and torque of the floor on the right sole over the tick, in the
            frame r_sole, (6,) [N, N m].
        imu: Reading of the IMU.
        counts: Counts of the door's encoder since the previous tick, one for each millisecond.
        left_hand_wrench: Mean force and torque of the surroundings on the left hand over the tick,
            in the frame of its link, (6,) [N, N m]; None without a sensor.
        right_hand_wrench: The same of the right hand.
    """

    time: float
    position: Array
    velocity: Array
    effort: Array
    left_wrench: Array
    right_wrench: Array
    imu: ImuSample
    counts: tuple[int, ...]
    left_hand_wrench: Array | None = None
    right_hand_wrench: Array | None = None

    @property
    def measured(self) -> Measured:
        """What a motion gets of it as one sample."""
        return Measured(self.position, self.velocity, self.imu, self.left_wrench,
                        self.right_wrench, self.time)


@dataclass(frozen=True)
class Command:
    """A trajectory for the driver.

    Attributes:
        stamp: Time of the robot's clock at which the time of the knots is 0 [s]; 0 means that the
            trajectory begins when it arrives.
        knots: The trajectory; None commands the driver's own stop.
    """

    stamp: float
    knots: Knots | None


class Driver(Protocol):
    """A robot that follows trajectories and measures, and the encoder of the door before it."""

    @property
    def time(self) -> float:
        """Time of the driver's clock, by which trajectories are stamped [s]."""

    def follow(self, trajectory: TrajectoryArrays, stamp: float) -> None:
        """Accept a trajectory, or refuse it as a whole and continue the present motion.

        Points that are over are skipped; the motion goes from the present reference to the next
        point, and holds the last point at its end. A trajectory without points means stop.

        Args:
            trajectory: Trajectory of all joints, in any order.
            stamp: Time at which its clock starts [s]; 0 means now.

        Raises:
            DoorImpactError: The trajectory is refused.
        """

    def stop(self) -> None:
        """Brake every joint and hold still."""

    def step(self) -> TickSample:
        """Advance to the end of the next control tick; return what was measured by then."""

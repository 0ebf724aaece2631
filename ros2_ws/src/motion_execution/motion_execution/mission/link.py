"""What a mission needs of the world: a graph of nodes has it, and a simulation without nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command
from impact_planner.task.known_door import KnownDoor
from robot_driver.inputs import Inputs
from walking.footsteps.footstep import Footstep, Pose

from motion_execution.mission.hit_plan import HitPlan


class Pending(Protocol):
    """A result that comes later, such as a `concurrent.futures.Future`."""

    def done(self) -> bool:
        """Whether it has come."""

    def result(self) -> Any:
        """Return it, or raise the error that there is instead."""


@dataclass(frozen=True)
class HitRequest:
    """A hit to be planned, with the names of PlanDoorImpact.

    Attributes:
        angle: Desired opening angle [rad]; negative: as configured.
        ending: hold or pass.
        run_up: Profile of the run-up; empty: as configured.
        door_distance: Distance of the leaf's face at B from the soles [m]; negative: as surveyed.
        l_b: Distance of B from the hinge [m]; negative: as surveyed.
    """

    angle: float
    ending: str
    run_up: str
    door_distance: float
    l_b: float


class Link(Protocol):
    """Messages to and from the robot, and plans. Before a door hinged at the left, mirrored.

    Attributes:
        inputs: The measurements; its present motion is that of the mission.
        door: What is known of the door; None: nothing.
        last_hit: The last hit that was planned by anyone; None before.
    """

    inputs: Inputs
    door: KnownDoor | None
    last_hit: HitPlan | None

    @property
    def yields(self) -> bool:
        """Whether the driver can let a hand yield."""

    def now(self) -> float:
        """Return the present time of the robot's clock [s]."""

    def clock(self) -> float:
        """Return the time of a steady clock by which patience is measured [s]."""

    def listen(self, *, on: bool) -> None:
        """Begin or end to hear the robot."""

    def refusal(self, topics: Sequence[str]) -> tuple[str, float] | None:
        """Return why no motion with topics can begin, a sentence and a value; None if one can."""

    def base(self) -> tuple[float, Pose] | None:
        """Return stamp [s] and pose of base_link in odom by the odometry; None before the first."""

    def zmp(self) -> tuple[float, Array] | None:
        """Return stamp [s] and place of the last ZMP in odom, (2,) [m]; None before the first."""

    def door_pose(self, along: float) -> Pose | None:
        """Return the door's pose in odom as somebody tells it; None if nobody does.

        Args:
            along: Distance from the hinge at which the leaf is touched [m].

        Raises:
            BadDoorPose: It makes no sense, is too old or too uncertain.
        """

    def send(self, command: Command) -> None:
        """Send a trajectory to the driver."""

    def comply(self, *impedance: float) -> None:
        """Let the right hand yield, [N/m, N s/m, kg]; without numbers it gets stiff."""

    def plan_hit(self, request: HitRequest) -> Pending:
        """Begin to plan a hit; the result is a `HitPlan`."""

    def compute(self, work: Callable[..., Any], *args: Any) -> Pending:
        """Begin to call a function with a robot of its own as its first argument."""

    def show(self, footsteps: Sequence[Footstep]) -> None:
        """Show footsteps to viewers."""

    def say(self, text: str, *, warning: bool = False) -> None:
        """Log a sentence."""

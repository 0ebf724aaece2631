"""The door beside a walk: what stands in the way, and ways around it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig

from walking.errors import NotReady, WalkInfeasible
from walking.footsteps.footstep import Footstep, Pose, Stance, as_array, stances
from walking.footsteps.rectangles import Rectangle, gaps
from walking.passing.doorway import Doorway

GAP = 0.05
"""Distance that a walking robot keeps from leaf, frame and wall [m]."""
_SWAY = 0.05  # by how much the body sways to either side in a walk [m]
_AJAR = math.radians(3.0)  # angle up to which the leaf counts as shut [rad]
_ROOM = 0.8  # distance of ways around something from it [m]
_EVERY = 0.05  # distance between two places of a way that are looked at [m, or rad / 4]
_LONG = 100.0  # length of the wall [m]
_FOOT = 0.01  # distance of a sole from a threshold [m]


@dataclass(frozen=True)
class Surroundings:
    """A door, as a robot that walks must know it.

    Attributes:
        doorway: Leaf and wall, with the hinge at the origin.
        axes: Pose of the doorway's axes in odom.
        angle: Opening angle of the leaf [rad].
        body: The robot with folded arms, seen from above from the middle between its soles [m].
    """

    doorway: Doorway
    axes: Pose
    angle: float
    body: Rectangle

    def require_free(
        self, robot: RobotConfig, stance: Stance, footsteps: Sequence[Footstep]
    ) -> None:
        """Check that footsteps lead past door and wall.

        Args:
            robot: The robot, for its soles.
            stance: The soles before them, in odom.

        Raises:
            WalkInfeasible: Something is in the way, or a foot would land on the threshold.
        """
        self.require_way([each.middle for each in stances(stance, footsteps)])
        for step in footsteps:
            place = as_array(step.pose.seen_from(self.axes))[None]
            gap = float(self.doorway.threshold_gaps(robot.soles[step.side], place)[0])
            if gap < _FOOT:
                raise WalkInfeasible(
                    f"the {step.side} foot would land {1e3 * gap:.0f} mm from the threshold, "
                    f"{1e3 * _FOOT:.0f} mm are required",
                    quantity="foot from the threshold [m]", value=gap, limit=_FOOT)

    def require_way(self, way: Sequence[Pose]) -> None:
        """Check that the body keeps its distance along a way.

        Where it stands nearer in the beginning, it may not come nearer still.

        Args:
            way: Places of the middle between the soles in odom; straight lines are between them.

        Raises:
            WalkInfeasible: Something is in the way.
        """
        places = self._along(way)
        found = self._gaps(places)
        nearest = found.min(axis=0)
        blocked = nearest < min(GAP, float(nearest[0]) - 1e-3)
        if not blocked.any():
            return
        at = int(np.argmax(blocked))
        open_by = f"the leaf, which stands open by {math.degrees(self.angle):.0f} deg,"
        what = "the wall" if found[0, at] < found[1, at] else (
            "the shut door" if self.angle < _AJAR else open_by)
        far = float(np.hypot(*np.diff(places[:at + 1, :2], axis=0).T).sum())
        raise WalkInfeasible(
            f"{what} is in the way after {far:.2f} m: the robot must keep {GAP:g} m from it",
            quantity="free way [m]", value=far, limit=GAP)

    def require_let_go(self, middle: Pose) -> None:
        """Check that the leaf would not shut onto the robot when its hand lets go.

        Args:
            middle: Middle between the soles in odom.

        Raises:
            NotReady: The robot stands in the leaf's way.
        """
        angles = np.linspace(0.0, max(0.0, self.angle), 50)
        place = np.tile(as_array(middle.seen_from(self.axes)), (len(angles), 1))
        gap = float(self.doorway.leaf_gaps(self.body, place, angles).min())
        if self.angle >= _AJAR and gap < 0.0:
            raise NotReady(
                f"the leaf, which stands open by {math.degrees(self.angle):.0f} deg, would shut "
                "onto the robot if its hand let go: walk_through_door goes on",
                quantity="robot from the leaf [m]", value=gap, limit=0.0)

    def detours(self, begin: Pose, goal: Pose) -> Iterator[list[Pose]]:
        """Yield places through which ways around the door lead, in odom.

        Args:
            begin: Middle between the soles at the beginning, in odom.
            goal: The same at the end.
        """
        near, far, tip = (self.axes.moved(*place) for place in self._corners())
        starts, ends = (pose.seen_from(self.axes).y > 0.0 for pose in (begin, goal))
        if starts == ends:
            yield [tip]
        elif starts:
            yield from ([near, far], [near, far, tip])
        else:
            yield from ([far, near], [tip, far, near])

    def _corners(self) -> tuple[Pose, ...]:
        """Places before and behind the opening, and beyond the leaf's free edge."""
        leaf, cos, sin = self.doorway.leaf, math.cos(self.angle), math.sin(self.angle)
        middle = 0.5 * (max(0.0, leaf.width * cos) + self.doorway.free_jamb)
        radius = leaf.width + _ROOM
        behind = self.doorway.far_face - _ROOM
        return (Pose(middle, self.doorway.frame.depth + _ROOM, 0.0), Pose(middle, behind, 0.0),
                Pose(radius * cos, min(behind, -radius * sin), 0.0))

    def _along(self, way: Sequence[Pose]) -> Array:
        """Return places along a way in the doorway's axes, (N, 3) [m, m, rad]."""
        corners = np.array([pose.seen_from(self.axes) for pose in way])
        corners[:, 2] = np.unwrap(corners[:, 2])
        found = [corners[:1]]
        for before, after in itertools.pairwise(corners):
            length = max(math.dist(before[:2], after[:2]), 0.25 * abs(after[2] - before[2]))
            share = np.linspace(0.0, 1.0, 2 + int(length / _EVERY))[1:, None]
            found.append(before + share * (after - before))
        return np.concatenate(found)

    def _gaps(self, places: Array) -> Array:
        """Distances from wall and leaf at places in the doorway's axes, (2, N) [m]."""
        back, ahead, right, left = self.body
        swaying = back, ahead, right - _SWAY, left + _SWAY
        angles = np.full(len(places), max(0.0, self.angle))
        doorway, still = self.doorway, np.zeros((1, 3))
        far, near, jamb = doorway.far_face, doorway.frame.depth, doorway.free_jamb
        # The wall goes on farther than it is known.
        walls = (jamb, _LONG, far, near), (-_LONG, doorway.leaf.width - jamb, far, near)
        return np.stack([np.min([gaps(swaying, places, wall, still) for wall in walls], axis=0),
                         doorway.leaf_gaps(swaying, places, angles)])

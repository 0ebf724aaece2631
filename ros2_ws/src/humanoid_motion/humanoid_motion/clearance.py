"""Distances of the robot's bodies from each other, from the leaf and from its frame in a motion.

Bodies are the collision shapes of the URDF's links. The leaf is a box that turns about a vertical
axis (`LeafCourse`), and the frame is boxes that stand still (`Box`); this package knows nothing
else of doors.

Which pairs of shapes count: Links joined by one joint are left out, and so are links joined by
several joints in one place with links without shapes between them (hip, waist, neck, shoulder,
ankle). There the covers of a real robot slide in each other, while boxes would collide within the
joints' ranges; these ranges are the check. Every other pair counts, also the braced arm against
trunk and thighs. Pairs that are nearer than the limit in half-sitting or in the braced posture rest
against each other by design: they must stay as far apart as they are there. Pairs that overlap
there are left out, because such shapes wrap links that touch anyway.

The floor is not checked.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from numpy.typing import ArrayLike

from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.motion import Motion
from humanoid_motion.nearest import Clearance, Indices, Pairs, nearest
from humanoid_motion.pinocchio_model import coal, collision_shapes
from humanoid_motion.robot_model import RobotModel, braced_upper_body

LEAF = "the leaf"
CLEARANCE = "clearance [m]"
"""Quantity of the error of bodies that come too near to each other."""

_ONE_PLACE = 0.05  # joints nearer to each other than this count as one place, such as a hip [m]
_ROOT = 1  # Pinocchio's index of the free joint of base_link
_REST_TOLERANCE = 1e-3  # by how much bodies that rest against each other may come nearer [m]
_Triple = tuple[float, float, float]


@dataclass(frozen=True)
class LeafCourse:
    """The leaf during a motion: a box that turns about a vertical axis.

    At angle 0 the box extends from the hinge along odom's x; its face, towards odom's y, lies in
    the plane through the hinge.

    Attributes:
        hinge: x and y of the hinge in odom, (2,) [m].
        angle: Opening angle at each sample of the motion, (N,) [rad].
        width: Distance from the hinge to the free edge [m].
        height: Height of the upper edge above the floor [m]; the doors of door_model have 2 m.
        thickness: Thickness of the box [m]; the doors of door_model have 0.04 m.
    """

    hinge: Array
    angle: Array
    width: float
    height: float = 2.0
    thickness: float = 0.04

    def pose(self, sample: int) -> Any:
        """Compute the pose of the box's middle in odom at a sample, as ``pinocchio.SE3``.

        Its x axis points from the hinge to the free edge, its y axis out of the face.
        """
        c, s = math.cos(self.angle[sample]), math.sin(self.angle[sample])
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        middle = turn @ [0.5 * self.width, -0.5 * self.thickness, 0.5 * self.height]
        middle[:2] += self.hinge
        return pin.SE3(turn, middle)


class Box(Protocol):
    """A box that stands still, with its edges along odom's axes, such as a part of a frame."""

    @property
    def name(self) -> str:
        """Its name in a `Clearance`."""

    @property
    def center(self) -> _Triple:
        """Its center in odom, (3,) [m]."""

    @property
    def half(self) -> _Triple:
        """Half lengths of its edges, (3,) [m]."""


class BodyGeometry:
    """Collision shapes of a robot, and the pairs of them that count.

    An object must not be shared between threads, because Pinocchio's work space is reused.

    Attributes:
        excluded: Pairs of links that do not count because they are joined, because they overlap
            in half-sitting or in the braced posture, or because the robot's configuration
            disables them.
        left_out: Links whose meshes could not be read, so that collisions with them are not found.
        links: Name of the link of each shape.
    """

    def __init__(self, robot: RobotModel) -> None:
        """Read the collision shapes of the URDF that the robot's configuration names."""
        self._robot = robot
        self._data = robot.model.createData()
        self._model, self.left_out = collision_shapes(robot.model, robot.config)
        objects = list(self._model.geometryObjects)
        self.links = tuple(robot.model.frames[item.parentFrame].name for item in objects)
        found = [_levers(robot, item) for item in objects]
        self._levers = np.array([joint for joint, _ in found])
        self._levers = self._levers.reshape(len(objects), len(robot.joint_names))
        self._base_levers = np.array([base for _, base in found])
        joints = [int(item.parentJoint) for item in objects]
        joined = _joined_bodies(robot.model, set(joints))
        counted, excluded = [], set()
        disabled = {frozenset(pair) for pair in robot.config.disabled_collisions}
        for a, b in itertools.combinations(range(len(objects)), 2):
            pair = frozenset((self.links[a], self.links[b]))
            if {(joints[a], joints[b]), (joints[b], joints[a])} & joined or pair in disabled:
                excluded.add((self.links[a], self.links[b]))
            elif joints[a] != joints[b]:
                counted.append((a, b))
        rest = self._resting(self._self_pairs(counted))
        for (a, b), distance in zip(counted, rest, strict=True):
            if distance < 0.0:
                excluded.add((self.links[a], self.links[b]))
        self.excluded = tuple(sorted(excluded))
        self._model.removeAllCollisionPairs()
        self._pairs = self._self_pairs(
            [pair for pair, distance in zip(counted, rest, strict=True) if distance >= 0.0])
        self._rest = rest[rest >= 0.0]
        self._with_boxes = lru_cache(maxsize=8)(self._shapes_with_boxes)

    @property
    def shapes(self) -> Any:
        """Pinocchio's geometry model of the shapes, in the order of `links`; do not change it."""
        return self._model

    def seen_from_above(
        self, joints: ArrayLike | None = None, without: Collection[str] = ()
    ) -> tuple[float, float, float, float]:
        """Bound the robot seen from above: x_min, x_max, y_min, y_max [m].

        They are those of the middle between the soles.

        Args:
            joints: Its joints, (J,) [rad]; None means half-sitting.
            without: Joints whose links, and all that these bear, are left out.
        """
        robot = self._robot
        q = robot.configuration(
            np.zeros(3), robot.config.half_sitting if joints is None else np.asarray(joints))
        placed = self._model.createData()
        pin.updateGeometryPlacements(robot.model, self._data, self._model, placed, q)
        left_out = {robot.model.getJointId(name) for name in without}
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for item, place in zip(self._model.geometryObjects, placed.oMg, strict=True):
            if left_out.intersection(robot.model.supports[item.parentJoint]):
                continue
            shape = coal.CollisionObject(
                item.geometry, coal.Transform3s(place.rotation, place.translation))
            shape.computeAABB()
            box = shape.getAABB()
            low, high = np.minimum(low, box.min_), np.maximum(high, box.max_)
        middle = np.mean([robot.frame_position(q, foot.frame) for foot in robot.feet.values()],
                         axis=0)
        (x_min, y_min), (x_max, y_max) = ((edge - middle)[:2].tolist() for edge in (low, high))
        return x_min, x_max, y_min, y_max

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Names of the pairs of links that count, sorted."""
        return tuple(sorted(set(self._pairs.names)))

    def resting(self, limit: float) -> dict[tuple[str, str], float]:
        """Find the pairs of links that rest against each other by design.

        Args:
            limit: Distance that other bodies must keep [m].

        Returns:
            Distance that each of these pairs must keep, below the limit [m].
        """
        required = self._required(limit)
        found: dict[tuple[str, str], float] = {}
        for index in np.flatnonzero(required < limit):
            name = self._pairs.names[index]
            found[name] = min(float(required[index]), found.get(name, limit))
        return found

    def beside(self, obstacles: Sequence[Any], which: Collection[int]) -> tuple[Any, list[Any]]:
        """Pair some of the robot's shapes with other shapes, obstacle by obstacle.

        Args:
            obstacles: Shapes of coal, which are put into the origin of odom.
            which: Indices of the robot's shapes.

        Returns:
            Pinocchio's geometry model of all of the robot's shapes, and behind them the obstacles;
            and the obstacles in it, which may be placed elsewhere.
        """
        geometry = pin.GeometryModel()
        for item in self._model.geometryObjects:
            geometry.addGeometryObject(item)
        for number, shape in enumerate(obstacles):
            index = geometry.addGeometryObject(
                pin.GeometryObject(f"obstacle {number}", 0, 0, pin.SE3.Identity(), shape))
            for body in which:
                geometry.addCollisionPair(pin.CollisionPair(body, index))
        return geometry, list(geometry.geometryObjects)[len(self.links):]

    def self_clearance(self, motion: Motion, limit: float) -> Clearance:
        """Find the two bodies of the robot that come nearest to their limit during a motion.

        Args:
            limit: Distance that bodies must keep [m]; the pairs of `resting` must keep less.
        """
        # The heading of the base moves all bodies alike.
        at = self._distances(self._pairs, self._robot.configurations(motion.base, motion.joints))
        return nearest(self._pairs, motion.joints, at, self._required(limit), motion.time)

    def leaf_clearance(
        self,
        motion: Motion,
        leaf: LeafCourse,
        limit: float,
        *,
        may_touch: Collection[str] = (),
        until: float = np.inf,
    ) -> Clearance:
        """Find the body of the robot that comes nearest to the leaf during a motion.

        Args:
            leaf: The leaf at the samples of the motion.
            limit: Distance that bodies must keep from the leaf [m].
            may_touch: Names of the links that may touch the leaf and are not checked.
            until: Time up to which the motion is checked [s].
        """
        half = 0.5 * leaf.width, 0.5 * leaf.thickness, 0.5 * leaf.height
        pairs, (box,) = self._box_pairs(((LEAF, half),), may_touch)
        far = np.full((len(pairs.names), 1), np.hypot(leaf.width, leaf.thickness))
        pairs = replace(pairs, slopes=np.hstack([pairs.slopes, far]))
        course, distances = self._course(motion, pairs, until)

        def at(sample: int, which: Indices) -> Array:
            box.placement = leaf.pose(sample)
            return distances(sample, which)

        course = np.column_stack([course, leaf.angle[:len(course)]])
        return nearest(pairs, course, at, np.full(len(pairs.names), limit), motion.time)

    def frame_clearance(
        self,
        motion: Motion,
        boxes: Sequence[Box],
        limit: float,
        *,
        may_touch: Collection[str] = (),
        until: float = np.inf,
    ) -> Clearance:
        """Find the body of the robot that comes nearest to one of some boxes during a motion.

        Args:
            boxes: Boxes that stand still, such as the parts of a door's frame.
            limit: Distance that bodies must keep from them [m].
            may_touch: Names of the links that may touch them and are not checked.
            until: Time up to which the motion is checked [s].
        """
        pairs, items = self._box_pairs(tuple((box.name, box.half) for box in boxes), may_touch)
        for item, box in zip(items, boxes, strict=True):
            item.placement = pin.SE3(np.eye(3), np.asarray(box.center, dtype=float))
        course, at = self._course(motion, pairs, until)
        return nearest(pairs, course, at, np.full(len(pairs.names), limit), motion.time)

    def _course(
        self, motion: Motion, pairs: Pairs, until: float
    ) -> tuple[Array, Callable[[int, Indices], Array]]:
        """Compute the coordinates of a motion up to a time [s], and pairs' distances along it.

        Returns:
            Joints, the base's x, y, z and heading, (N, J + 4); and a function as `nearest` needs.
        """
        count = max(1, int(np.searchsorted(motion.time, until + 1e-9)))
        base, joints = motion.base[:count], motion.joints[:count]
        yaw = np.zeros(count) if motion.base_yaw is None else motion.base_yaw.angle[:count]
        return np.column_stack([joints, base, yaw]), self._distances(
            pairs, self._robot.configurations(base, joints, yaw))

    def _self_pairs(self, counted: list[tuple[int, int]]) -> Pairs:
        slopes = np.zeros((len(counted), self._levers.shape[1]))
        for row, (a, b) in zip(slopes, counted, strict=True):
            self._model.addCollisionPair(pin.CollisionPair(a, b))
            # A joint that moves both shapes does not change their distance.
            one, two = self._levers[a], self._levers[b]
            row[:] = np.where((one > 0.0) & (two > 0.0), 0.0, one + two)
        names = [(self.links[a], self.links[b]) for a, b in counted]
        return Pairs(self._model, self._model.createData(), names, slopes)

    def _box_pairs(
        self, boxes: tuple[tuple[str, _Triple], ...], may_touch: Collection[str]
    ) -> tuple[Pairs, list[Any]]:
        """Pair every shape that must not touch with every box; return the pairs and the boxes."""
        geometry, names, slopes = self._with_boxes(boxes, frozenset(may_touch))
        # The work space is new each time, because coal starts each search from its last result:
        # a used one would make a plan depend on the plans before it, by less than 1e-6 m.
        pairs = Pairs(geometry, geometry.createData(), names, slopes)
        return pairs, list(geometry.geometryObjects)[len(self.links):]

    def _shapes_with_boxes(
        self, boxes: tuple[tuple[str, _Triple], ...], may_touch: frozenset[str]
    ) -> tuple[Any, list[tuple[str, str]], Array]:
        """Pair every shape that must not touch with boxes of some names and half lengths [m].

        Returns:
            Pinocchio's geometry model with the boxes as its last shapes, and the names and slopes
            of the pairs as in `Pairs`; the coordinates are the joints, and the base's x, y, z and
            heading.
        """
        kept = [i for i, name in enumerate(self.links) if name not in may_touch]
        geometry, _ = self.beside([coal.Box(*(2.0 * np.array(half))) for _, half in boxes], kept)
        names = [(self.links[i], name) for name, _ in boxes for i in kept]
        slopes = np.column_stack(
            [self._levers[kept], np.ones((len(kept), 3)), self._base_levers[kept]])
        return geometry, names, np.tile(slopes, (len(boxes), 1))

    def _required(self, limit: float) -> Array:
        """Compute the distance that each pair of shapes must keep, (P,) [m]."""
        return np.minimum(limit, self._rest - _REST_TOLERANCE)

    def _resting(self, pairs: Pairs) -> Array:
        """Compute each pair's distance in half-sitting or braced, the smaller one, (P,) [m]."""
        postures = np.array([self._robot.config.half_sitting, braced_upper_body(self._robot)])
        at = self._distances(pairs, self._robot.configurations(np.zeros((2, 3)), postures))
        every = np.arange(len(pairs.names))
        return np.minimum(at(0, every), at(1, every))

    def _distances(self, pairs: Pairs, q: Array) -> Callable[[int, Indices], Array]:
        """Make the function that computes the distances [m] of some pairs at a sample of q."""
        model, data = self._robot.model, self._data

        def at(sample: int, which: Indices) -> Array:
            pin.updateGeometryPlacements(model, data, pairs.geometry, pairs.data, q[sample])
            found = [
                pin.computeDistance(pairs.geometry, pairs.data, pair).min_distance
                for pair in which.tolist()
            ]
            return np.array(found, dtype=float)

        return at


@lru_cache(maxsize=4)
def bodies_of(robot: RobotModel) -> BodyGeometry:
    """Return the collision shapes of a robot; they are built once and kept for the last robots."""
    return BodyGeometry(robot)


def require_clearance(found: Clearance, phase: str) -> None:
    """Check that the two bodies of a clearance keep the distance that they must.

    Args:
        phase: Name of the motion's phase, for the message.

    Raises:
        PostureUnreachable: The distance is smaller than the limit.
    """
    if found.distance >= found.limit:
        return
    one, two = found.bodies
    distance, limit = 1e3 * found.distance, 1e3 * found.limit
    place = f"come to {distance:.1f} mm from" if distance > 0.0 else f"be {-distance:.1f} mm inside"
    raise PostureUnreachable(
        f"{phase}: {one} would {place} {two} at {found.time:.2f} s, {limit:.1f} mm are required",
        quantity=CLEARANCE,
        value=found.distance,
        limit=found.limit,
        phase=phase,
    )


def _levers(robot: RobotModel, item: Any) -> tuple[Array, float]:
    """Bound the distance of a shape's points from the axis of each joint that moves it.

    Args:
        item: A shape of `collision_shapes`.

    Returns:
        Upper bounds in the robot's joint order, (J,) [m]; 0 for joints that do not move the shape.
        And an upper bound of the distance from base_link's origin [m].
    """
    model = robot.model
    item.geometry.computeLocalAABB()
    centre = item.placement.act(item.geometry.aabb_center)
    far = float(np.linalg.norm(centre)) + float(item.geometry.aabb_radius)
    found = np.zeros(model.nv)
    joint = int(item.parentJoint)
    while joint > _ROOT:
        found[model.joints[joint].idx_v] = far
        far += float(np.linalg.norm(model.jointPlacements[joint].translation))
        joint = int(model.parents[joint])
    return found[robot.v_index], far


def _joined_bodies(model: Any, bodies: set[int]) -> set[tuple[int, int]]:
    """Find the bodies that are joined by one joint, or by several joints in one place.

    Args:
        model: Pinocchio's model.
        bodies: Indices of the joints whose bodies have shapes.

    Returns:
        Pairs (child, parent) of these indices.
    """
    joined = set()
    for body in bodies - {_ROOT}:
        joint, parent = body, int(model.parents[body])
        while parent > _ROOT and parent not in bodies:
            if np.linalg.norm(model.jointPlacements[joint].translation) > _ONE_PLACE:
                break
            joint, parent = parent, int(model.parents[parent])
        if parent in bodies:
            joined.add((body, parent))
    return joined

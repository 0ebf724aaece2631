"""How near the robot's bodies come to each other and to the leaf, at every sample of a motion.

Bodies are the URDF's collision shapes: boxes, cylinders, spheres, and meshes by their convex hull.

Which pairs count. Links joined by one joint are left out, and so are links joined by several
joints in one place with shapeless links between them (hip, waist, neck, shoulder, ankle): there
the covers of a real robot slide in each other, boxes would collide within the joints' ranges, and
these ranges are the check. Every other pair counts, the braced arm against trunk and thighs too.
Pairs that are nearer than the limit in half-sitting or in the braced posture rest against each
other by design: they may come as near as they are there, and no nearer. Pairs that overlap there
are left out, as shapes that only wrap what is joined.

Why few samples are computed. A point of a body moves by at most its distance from a joint's axis
times the joint's way, so two bodies d_a and d_b apart at samples a and b are at least
(d_a + d_b - way) / 2 apart in between (Schwarzer, Saha and Latombe, Adaptive dynamic collision
checking, IEEE T-RO 21(3), 2005). Only where that does not rule out a new minimum is the interval
halved; the outcome is that of computing every pair at every sample. Signed distances of convex
shapes obey this as well when they are negative.

Not looked at: the floor, and walls beside the door, which nothing in the project has.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import lru_cache
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from numpy.typing import NDArray

from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel, braced_upper_body

Indices = NDArray[np.int_]

LEAF = "the leaf"
_ONE_PLACE = 0.05  # joints nearer than this are one place, such as a hip [m]
_REST_TOLERANCE = 1e-3  # by which bodies that rest against each other may come nearer [m]
_RESOLUTION = 1e-6  # of distances [m]; coal's own is not better
_ROOT = 1  # the free joint of base_link

_shapes = pin.coal if hasattr(pin, "coal") else pin.hppfcl  # its name in Jazzy's Pinocchio


@dataclass(frozen=True)
class LeafCourse:
    """Where the leaf is during a motion: a box with its face in the plane through the hinge.

    Attributes:
        hinge: x and y of the hinge in odom, (2,) [m].
        angle: Opening angle at the motion's samples, (N,) [rad].
        width: From the hinge to the free edge [m].
        height: Above the floor [m]; the doors of door_model have 2 m.
        thickness: [m]; the doors of door_model have 0.04 m.
    """

    hinge: Array
    angle: Array
    width: float
    height: float = 2.0
    thickness: float = 0.04

    def pose(self, sample: int) -> Any:
        """Pose of the box's middle in odom; x along the leaf, y out of its face (`LeafFrame`)."""
        c, s = math.cos(self.angle[sample]), math.sin(self.angle[sample])
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        middle = turn @ [0.5 * self.width, -0.5 * self.thickness, 0.5 * self.height]
        middle[:2] += self.hinge
        return pin.SE3(turn, middle)


@dataclass(frozen=True)
class Clearance:
    """Where a motion comes nearest to a limit.

    Attributes:
        bodies: The links, or a link and `LEAF`; empty where no pair counts.
        distance: Between them, negative: depth of penetration [m]; infinite where no pair counts.
        limit: Required between these two [m].
        time: When, from the start of the motion [s].
    """

    bodies: tuple[str, ...]
    distance: float
    limit: float
    time: float


@dataclass(frozen=True)
class _Pairs:
    """Pairs of shapes to compute.

    Attributes:
        geometry: Pinocchio's, with its collision pairs (P).
        data: Its work space.
        names: Links of each pair.
        slopes: Largest change of the distances with the coordinates, (P, M) [m/rad, m/m].
    """

    geometry: Any
    data: Any
    names: list[tuple[str, str]]
    slopes: Array


class BodyGeometry:
    """Collision shapes of a robot, and the pairs that count; built once.

    Not safe to share between threads: Pinocchio's work space is reused.

    Attributes:
        excluded: Pairs of links left out because a joint, or joints in one place, join them,
            because they overlap there by design, or because the robot's configuration says so.
        left_out: Links with meshes, where one of them is missing: nothing is known of these.
        links: Link of each shape.
    """

    def __init__(self, robot: RobotModel) -> None:
        """Read the shapes of the URDF that the robot's configuration names."""
        self._robot = robot
        self._data = robot.model.createData()
        self._model, self.left_out = _load(robot)
        objects = list(self._model.geometryObjects)
        self.links = tuple(robot.model.frames[item.parentFrame].name for item in objects)
        self._reach = np.array([_reach(robot, item) for item in objects])
        self._reach = self._reach.reshape(len(objects), len(robot.joint_names))
        joints = [int(item.parentJoint) for item in objects]
        joined = _joined(robot.model, set(joints))
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

    @property
    def shapes(self) -> Any:
        """Pinocchio's geometry of the shapes, in the order of `links`; to be read only."""
        return self._model

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Pairs of links that count, sorted."""
        return tuple(sorted(set(self._pairs.names)))

    def resting(self, limit: float) -> dict[tuple[str, str], float]:
        """Pairs that rest against each other by design, and what they must keep [m]."""
        required = self._required(limit)
        found: dict[tuple[str, str], float] = {}
        for index in np.flatnonzero(required < limit):
            name = self._pairs.names[index]
            found[name] = min(float(required[index]), found.get(name, limit))
        return found

    def self_clearance(self, motion: Motion, limit: float) -> Clearance:
        """Where two bodies of the robot have least left over, of all samples of a motion.

        Args:
            motion: The motion.
            limit: Distance that bodies must keep [m]; those of `resting` keep less.
        """
        at = self._distances(self._pairs, self._configurations(motion.base, motion.joints))
        return _nearest(self._pairs, motion.joints, at, self._required(limit), motion.time)

    def leaf_clearance(
        self,
        motion: Motion,
        leaf: LeafCourse,
        limit: float,
        *,
        may_touch: Collection[str] = (),
        until: float = np.inf,
    ) -> Clearance:
        """Where a body of the robot comes nearest to the leaf, of the samples of a motion.

        Args:
            motion: The motion.
            leaf: Where the leaf is at its samples.
            limit: Distance that bodies must keep [m].
            may_touch: Links that may touch the leaf: all their shapes are left out.
            until: Time up to which the motion counts [s].
        """
        count = max(1, int(np.searchsorted(motion.time, until + 1e-9)))
        base, joints = motion.base[:count], motion.joints[:count]
        pairs, box = self._leaf_pairs(leaf, may_touch)
        distances = self._distances(pairs, self._configurations(base, joints))

        def at(sample: int, which: Indices) -> Array:
            box.placement = leaf.pose(sample)
            return distances(sample, which)

        course = np.column_stack([joints, base, leaf.angle[:count]])
        return _nearest(pairs, course, at, np.full(len(pairs.names), limit), motion.time)

    def _self_pairs(self, counted: list[tuple[int, int]]) -> _Pairs:
        slopes = np.zeros((len(counted), self._reach.shape[1]))
        for row, (a, b) in zip(slopes, counted, strict=True):
            self._model.addCollisionPair(pin.CollisionPair(a, b))
            # What turns both alike does not change their distance.
            one, two = self._reach[a], self._reach[b]
            row[:] = np.where((one > 0.0) & (two > 0.0), 0.0, one + two)
        names = [(self.links[a], self.links[b]) for a, b in counted]
        return _Pairs(self._model, self._model.createData(), names, slopes)

    def _leaf_pairs(self, leaf: LeafCourse, may_touch: Collection[str]) -> tuple[_Pairs, Any]:
        """Every shape but those that may touch against the leaf, and the leaf."""
        geometry = pin.GeometryModel()
        for item in self._model.geometryObjects:
            geometry.addGeometryObject(item)
        box = _shapes.Box(leaf.width, leaf.thickness, leaf.height)
        index = geometry.addGeometryObject(
            pin.GeometryObject(LEAF, 0, 0, pin.SE3.Identity(), box))
        kept = [i for i, name in enumerate(self.links) if name not in may_touch]
        for i in kept:
            geometry.addCollisionPair(pin.CollisionPair(i, index))
        far = float(np.hypot(leaf.width, leaf.thickness))
        others = np.tile([1.0, 1.0, 1.0, far], (len(kept), 1))  # base, angle of the leaf
        slopes = np.hstack([self._reach[kept], others])
        names = [(self.links[i], LEAF) for i in kept]
        pairs = _Pairs(geometry, geometry.createData(), names, slopes)
        return pairs, geometry.geometryObjects[index]

    def _required(self, limit: float) -> Array:
        """What each pair of shapes must keep, (P,) [m]."""
        return np.minimum(limit, self._rest - _REST_TOLERANCE)

    def _resting(self, pairs: _Pairs) -> Array:
        """Smallest distance of each pair in half-sitting and in the braced posture, (P,) [m]."""
        postures = np.array([self._robot.config.half_sitting, braced_upper_body(self._robot)])
        at = self._distances(pairs, self._configurations(np.zeros((2, 3)), postures))
        every = np.arange(len(pairs.names))
        return np.minimum(at(0, every), at(1, every))

    def _configurations(self, base: Array, joints: Array) -> Array:
        q = np.tile(np.array(pin.neutral(self._robot.model)), (len(base), 1))
        q[:, :3] = base
        q[:, self._robot.q_index] = joints
        return q

    def _distances(self, pairs: _Pairs, q: Array) -> Callable[[int, Indices], Array]:
        """Distances [m] of some pairs at a sample."""
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
    """The collision shapes of a robot; built at the first call, kept for the last few robots."""
    return BodyGeometry(robot)


def require_clearance(found: Clearance, phase: str) -> None:
    """Check that bodies keep the distance that they must.

    Raises:
        PostureUnreachable: Naming the phase, both bodies, the distance and the limit.
    """
    if found.distance >= found.limit:
        return
    one, two = found.bodies
    distance, limit = 1e3 * found.distance, 1e3 * found.limit
    place = f"come to {distance:.1f} mm from" if distance > 0.0 else f"be {-distance:.1f} mm inside"
    raise PostureUnreachable(
        f"{phase}: {one} would {place} {two} at {found.time:.2f} s, {limit:.1f} mm are required",
        quantity="clearance [m]",
        value=found.distance,
        limit=found.limit,
        phase=phase,
    )


def _nearest(
    pairs: _Pairs,
    course: Array,
    distances: Callable[[int, Indices], Array],
    required: Array,
    time: Array,
) -> Clearance:
    """Least distance beyond the required one, by branch and bound over intervals of samples.

    Args:
        pairs: The pairs (P).
        course: Coordinates that move them, (N, M) [rad, m].
        distances: Of some pairs at a sample [m].
        required: Distances that pairs must keep, (P,) [m].
        time: Of the samples, (N,) [s].
    """
    if not pairs.names:
        return Clearance((), np.inf, 0.0, 0.0)
    way = np.zeros(course.shape)
    np.cumsum(np.abs(np.diff(course, axis=0)), axis=0, out=way[1:])
    best = (np.inf, 0, 0)  # left over [m], pair, sample

    def spare(sample: int, which: Indices) -> Array:
        nonlocal best
        left = distances(sample, which) - required[which]
        least = int(np.argmin(left))
        best = min(best, (float(left[least]), int(which[least]), sample))
        return left

    # Intervals by what is possible within; of each: ends, pairs, at the ends.
    heap: list[tuple[float, int, int, Indices, Array, Array]] = []

    def add(a: int, b: int, which: Indices, at_a: Array, at_b: Array) -> None:
        possible = 0.5 * (at_a + at_b - pairs.slopes[which] @ (way[b] - way[a]))
        keep = possible < best[0] - _RESOLUTION
        if b - a > 1 and keep.any():
            row = (float(possible.min()), a, b, which[keep], at_a[keep], at_b[keep])
            heapq.heappush(heap, row)

    every, last = np.arange(len(pairs.names)), len(course) - 1
    moving = np.flatnonzero(pairs.slopes @ way[last] > 0.0)
    at_first = spare(0, every)[moving]
    if moving.size:
        add(0, last, moving, at_first, spare(last, moving))
    while heap and heap[0][0] < best[0] - _RESOLUTION:
        _, a, b, which, at_a, at_b = heapq.heappop(heap)
        middle = (a + b) // 2
        at_middle = spare(middle, which)
        add(a, middle, which, at_a, at_middle)
        add(middle, b, which, at_middle, at_b)
    left, pair, sample = best
    limit = float(required[pair])
    return Clearance(pairs.names[pair], left + limit, limit, float(time[sample]))


def _load(robot: RobotModel) -> tuple[Any, tuple[str, ...]]:
    """Shapes of the robot's URDF, meshes by their hulls, and the links without theirs."""
    path, kind = robot.config.urdf_path, pin.GeometryType.COLLISION
    left_out: list[str] = []
    try:
        folders = [str(folder) for folder in path.resolve().parents]  # of package://
        geometry = pin.buildGeomFromUrdf(robot.model, str(path), kind, package_dirs=folders)
    except ValueError:  # a mesh is not there: without any
        root = ElementTree.parse(path).getroot()
        for link in root.findall("link"):
            for shape in link.findall("collision"):
                if shape.find("geometry/mesh") is not None:
                    link.remove(shape)
                    left_out.append(link.attrib["name"])
        text = ElementTree.tostring(root, encoding="unicode")
        geometry = pin.buildGeomFromUrdfString(robot.model, text, kind)
    for item in geometry.geometryObjects:
        if item.geometry.getObjectType() == _shapes.OBJECT_TYPE.OT_BVH:
            item.geometry.buildConvexRepresentation(False)
            item.geometry = item.geometry.convex
    return geometry, tuple(dict.fromkeys(left_out))


def _reach(robot: RobotModel, item: Any) -> Array:
    """Largest distance of a shape's points from the joints that turn it, (30,) [m]."""
    model = robot.model
    item.geometry.computeLocalAABB()
    centre = item.placement.act(item.geometry.aabb_center)
    far = float(np.linalg.norm(centre)) + float(item.geometry.aabb_radius)
    reach = np.zeros(model.nv)
    joint = int(item.parentJoint)
    while joint > _ROOT:
        reach[model.joints[joint].idx_v] = far
        far += float(np.linalg.norm(model.jointPlacements[joint].translation))
        joint = int(model.parents[joint])
    return reach[robot.v_index]


def _joined(model: Any, bodies: set[int]) -> set[tuple[int, int]]:
    """Joints whose shapes are joined, by a joint or by several in one place: (child, parent)."""
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

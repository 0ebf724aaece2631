"""Clearance of the robot's bodies from each other, from the leaf and from its frame."""

import dataclasses
import itertools
import math
import re
import struct
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from humanoid_motion.clearance import LEAF, BodyGeometry, LeafCourse, require_clearance
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.motion import BaseYaw, from_derivatives, min_jerk
from humanoid_motion.nearest import Pairs, nearest
from humanoid_motion.pinocchio_model import coal
from humanoid_motion.robot_model import RobotModel
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

LIMIT = 0.01
HIP_HEIGHT = 0.65
# Of the right side and the middle.
EXCLUDED = {
    ("base_link", "RLEG_LINK2"), ("RLEG_LINK2", "RLEG_LINK3"), ("RLEG_LINK3", "r_sole"),
    ("base_link", "torso"), ("torso", "HEAD_LINK1"), ("torso", "RARM_LINK1"),
    ("RARM_LINK1", "RARM_LINK2"), ("RARM_LINK2", "RARM_LINK3"), ("RARM_LINK3", "RARM_LINK4"),
    ("RARM_LINK4", "RARM_LINK5"), ("RARM_LINK4", "r_gripper"),
}  # fmt: skip


class Part(NamedTuple):
    """A box that stands still; `center` and `half` as in `humanoid_motion.clearance.Box`."""

    name: str
    center: tuple
    half: tuple


@pytest.fixture(scope="module")
def geometry(robot):
    """Bodies of HRP-2."""
    return BodyGeometry(robot)


def moving(joints, base=(0.0, 0.0, HIP_HEIGHT), period=0.005):
    """Motion through postures (N, 30) or (30,) and places; its speeds are of no interest here."""
    joints = np.atleast_2d(joints)
    place = np.hstack([joints, np.broadcast_to(base, (len(joints), 3))])
    zero = np.zeros_like(place)
    return from_derivatives(period * np.arange(len(joints)), place, zero, zero)


def between(first, last, count=100):
    """Minimum-jerk postures from one to another, (count, 30)."""
    part = min_jerk(np.linspace(0.0, 1.0, count), 1.0)[:, None]
    return first + part * (np.asarray(last) - first)


def wall(motion, hinge, angle=0.0, **size):
    """A leaf that stands still, or follows angles (N,)."""
    angles = np.broadcast_to(np.asarray(angle, dtype=float), len(motion))
    return LeafCourse(np.asarray(hinge, dtype=float), angles, size.pop("width", 0.9), **size)


def unordered(pairs):
    """Pairs without their order."""
    return {frozenset(pair) for pair in pairs}


def mirrored_name(name):
    """The link of the other side."""
    other = {"R": "L", "L": "R", "r": "l", "l": "r"}
    side = re.match(r"[RL](LEG|ARM)_|[rl]_", name)
    return other[name[0]] + name[1:] if side else name


def with_head_of_mesh(robot, folder, name):
    """The robot with a mesh in place of the head's sphere."""
    tree = ElementTree.parse(robot.config.urdf_path)
    geometry = tree.find("link[@name='HEAD_LINK1']/collision/geometry")
    geometry.remove(geometry.find("sphere"))
    ElementTree.SubElement(geometry, "mesh", filename=name)
    tree.write(folder / "robot.urdf")
    return RobotModel(dataclasses.replace(robot.config, urdf_path=folder / "robot.urdf"))


def brute_force(robot, motion, leaf=None, may_touch=()):
    """Smallest distance of all pairs at all samples, by Pinocchio alone."""
    urdf = str(robot.config.urdf_path)
    shapes = pin.buildGeomFromUrdf(robot.model, urdf, pin.GeometryType.COLLISION)
    links = [robot.model.frames[item.parentFrame].name for item in shapes.geometryObjects]
    out = unordered(EXCLUDED | {tuple(map(mirrored_name, pair)) for pair in EXCLUDED})
    if leaf is None:
        for i, j in itertools.combinations(range(len(links)), 2):
            same = shapes.geometryObjects[i].parentJoint == shapes.geometryObjects[j].parentJoint
            if not same and frozenset((links[i], links[j])) not in out:
                shapes.addCollisionPair(pin.CollisionPair(i, j))
    else:
        box = coal.Box(leaf.width, leaf.thickness, leaf.height)
        last = shapes.addGeometryObject(pin.GeometryObject(LEAF, 0, 0, pin.SE3.Identity(), box))
        for i in range(len(links)):
            if links[i] not in may_touch:
                shapes.addCollisionPair(pin.CollisionPair(i, last))
    data, work = robot.model.createData(), shapes.createData()
    found = np.inf
    for i in range(len(motion)):
        if leaf is not None:
            sine, cosine = math.sin(leaf.angle[i]), math.cos(leaf.angle[i])
            along, out = np.array([cosine, -sine, 0.0]), np.array([sine, cosine, 0.0])
            turn = np.column_stack([along, out, [0.0, 0.0, 1.0]])
            middle = np.append(leaf.hinge, leaf.height / 2)
            middle += along * leaf.width / 2 - out * leaf.thickness / 2
            shapes.geometryObjects[last].placement = pin.SE3(turn, middle)
        q = robot.configuration(motion.base[i], motion.joints[i])
        pin.updateGeometryPlacements(robot.model, data, shapes, work, q)
        pin.computeDistances(shapes, work)
        found = min(found, *(result.min_distance for result in work.distanceResults))
    return found


@st.composite
def wandering(draw, robot):
    """Short motions: a few joints wander smoothly, a single sample jumps, the base drifts."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(1, 40))
    knots = random.uniform(robot.lower, robot.upper, (3, len(robot.lower)))
    share = draw(st.floats(0.0, 1.0))
    relaxed = robot.config.half_sitting
    u = np.linspace(0.0, 1.0, count)[:, None]
    turn = (1 - u) ** 2 * knots[0] + 2 * u * (1 - u) * knots[1] + u**2 * knots[2]
    moves = random.random(len(relaxed)) < draw(st.floats(0.0, 1.0))
    joints = np.where(moves, relaxed + share * (turn - relaxed), relaxed)
    jump = draw(st.integers(0, count - 1))
    joints[jump] += draw(st.sampled_from([0.0, 0.3])) * random.uniform(-1.0, 1.0, len(relaxed))
    drift = u * random.uniform(-0.3, 0.3, 3)
    return moving(joints, np.array([0.0, 0.0, HIP_HEIGHT]) + drift)


@given(data=st.data())
def test_outcome_is_that_of_every_pair_at_every_sample(robot, geometry, data):
    """For random motions, the result is that of computing all distances."""
    motion = data.draw(wandering(robot))
    found = geometry.self_clearance(motion, LIMIT)
    assert found.distance == pytest.approx(brute_force(robot, motion), abs=1e-5)
    assert found.time in motion.time


@given(data=st.data(), start=st.floats(-0.3, 1.5), end=st.floats(-0.3, 1.5))
def test_outcome_is_that_of_every_body_against_a_moving_leaf(robot, geometry, data, start, end):
    """For random motions of robot and leaf; links that may touch do not count."""
    motion = data.draw(wandering(robot))
    leaf = wall(motion, (-0.4, -0.6), np.linspace(start, end, len(motion)))
    touch = data.draw(st.sets(st.sampled_from(geometry.links), max_size=10))
    found = geometry.leaf_clearance(motion, leaf, LIMIT, may_touch=touch)
    assert found.distance == pytest.approx(brute_force(robot, motion, leaf, touch), abs=1e-5)
    assert found.bodies[1] == LEAF
    assert found.bodies[0] not in touch


@given(data=st.data(), seed=st.integers(0, 2**32 - 1), count=st.integers(1, 4))
def test_a_part_of_a_frame_is_a_leaf_that_stands_still(robot, geometry, data, seed, count):
    """The nearest of some boxes, also to a turning robot, is the nearest as a leaf."""
    motion, random = data.draw(wandering(robot)), np.random.default_rng(seed)
    yaw = random.uniform(-4.0, 4.0) + random.uniform(-9.0, 9.0) * motion.time
    motion = dataclasses.replace(motion, base_yaw=BaseYaw(yaw, 0.0 * yaw, 0.0 * yaw))
    touch = data.draw(st.sets(st.sampled_from(geometry.links), max_size=10))
    boxes, alone = [], []
    for number, half in enumerate(random.uniform(0.01, 0.8, (count, 3))):
        x, y = random.uniform(-1.5, 1.5, 2)
        boxes.append(Part(f"part {number}", (x, y, half[2]), tuple(half)))
        width, thickness, height = 2.0 * half
        leaf = wall(motion, (x - half[0], y + half[1]), width=width, thickness=thickness,
                    height=height)
        alone.append(geometry.leaf_clearance(motion, leaf, LIMIT, may_touch=touch).distance)
    found = geometry.frame_clearance(motion, boxes, LIMIT, may_touch=touch)
    assert found.distance == pytest.approx(min(alone), abs=1e-5)
    assert found.bodies[1] == f"part {np.argmin(alone)}"
    assert found.bodies[0] not in touch


def test_a_jamb_that_the_robot_walks_into_is_named_and_what_follows_does_not_count(
    robot, geometry
):
    """A robot that walks aside, into a jamb; until it has begun, the jamb is as far as at rest."""
    joints = np.tile(robot.config.half_sitting, (101, 1))
    base = [0.0, 0.0, HIP_HEIGHT] + np.linspace(0.0, 0.15, 101)[:, None] * [0.0, -1.0, 0.0]
    jamb = Part("jamb", (0.0, -0.9, 1.0), (1.0, 0.4, 1.0))
    far = Part("wall", (0.0, 3.0, 1.0), (1.0, 0.4, 1.0))
    motion = moving(joints, base)
    at_rest = geometry.frame_clearance(moving(joints[0]), [far, jamb], LIMIT)
    found = geometry.frame_clearance(motion, [far, jamb], LIMIT)
    assert found.distance == pytest.approx(at_rest.distance - 0.15, abs=1e-5)
    assert found.time == pytest.approx(motion.duration)
    early = geometry.frame_clearance(motion, [far, jamb], LIMIT, until=0.0)
    assert early.distance == pytest.approx(at_rest.distance, abs=1e-6)
    with pytest.raises(PostureUnreachable, match="jamb"):
        require_clearance(found, "walk")


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 60), calm=st.floats(0.0, 1.0))
def test_the_search_misses_nothing_that_the_bound_allows(seed, count, calm):
    """Distances that change exactly as fast as their bound, with single samples that jump."""
    random = np.random.default_rng(seed)
    rates = random.normal(size=(5, 3)) * (random.random((5, 3)) < 0.5)
    course = random.normal(size=(count, 3)) * (random.random((count, 1)) > calm)
    table = random.uniform(1.0, 4.0, 5) + course @ rates.T
    required = random.uniform(0.0, 2.0, 5)
    pairs = Pairs(None, None, [(str(i), "other") for i in range(5)], np.abs(rates))
    time = np.arange(count, dtype=float)
    found = nearest(pairs, course, lambda i, which: table[i, which], required, time)
    left = table - required
    assert found.distance - found.limit == pytest.approx(left.min(), abs=2e-6)
    sample, pair = int(found.time), int(found.bodies[0])
    assert left[sample, pair] == pytest.approx(left.min(), abs=2e-6)


def test_a_single_bad_sample_of_two_thousand_is_found_and_named(robot, geometry):
    """A hand that is inside the thigh for one sample; the sentence says what and how far."""
    joints = np.tile(robot.config.half_sitting, (2000, 1))
    joints[777] = robot.config.posture({"RARM_JOINT1": math.radians(10.0)}, np.zeros(30))
    found = geometry.self_clearance(moving(joints), LIMIT)
    assert set(found.bodies) == {"r_gripper", "RLEG_LINK2"}
    assert found.distance < 0.0
    assert found.time == pytest.approx(0.005 * 777)
    with pytest.raises(PostureUnreachable, match="prepare") as raised:
        require_clearance(found, "prepare")
    assert all(name in str(raised.value) for name in found.bodies)
    assert (raised.value.value, raised.value.limit) == (found.distance, LIMIT)


def test_a_knee_into_the_leaf_is_found_and_named(robot, geometry):
    """A right knee that bends towards a leaf in front of the robot is found and named."""
    bent = {"RLEG_JOINT2": -60.0, "RLEG_JOINT3": 120.0, "RLEG_JOINT4": -60.0}
    last = robot.config.posture({name: math.radians(deg) for name, deg in bent.items()})
    motion = moving(between(robot.config.half_sitting, last))
    clear = geometry.leaf_clearance(motion, wall(motion, (0.5, -0.5), -math.pi / 2), LIMIT)
    require_clearance(clear, "cam")
    found = geometry.leaf_clearance(motion, wall(motion, (0.32, -0.5), -math.pi / 2), LIMIT)
    assert found.bodies == ("RLEG_LINK3", LEAF)
    assert found.distance == pytest.approx(clear.distance - 0.18, abs=1e-5)
    assert found.time == pytest.approx(motion.time[-1])


def test_only_links_that_a_joint_joins_are_excluded(geometry):
    """Twenty pairs; every other pair of links counts, unless both are one rigid body."""
    expected = unordered(EXCLUDED | {tuple(map(mirrored_name, pair)) for pair in EXCLUDED})
    assert unordered(geometry.excluded) == expected
    assert geometry.left_out == ()
    rigid = unordered([("RARM_LINK5", "r_gripper"), ("LARM_LINK5", "l_gripper")])
    every = unordered(itertools.combinations(set(geometry.links), 2))
    assert unordered(geometry.pairs) == every - expected - rigid


def test_bodies_that_rest_against_each_other_come_no_nearer(robot):
    """A brace with the hand at the waist is taken as meant, but not a hand nearer to it."""
    braced = dict(robot.config.braced_posture)
    braced["RARM_JOINT1"] += math.radians(1.9)
    config = dataclasses.replace(robot.config, braced_posture=braced)
    geometry = BodyGeometry(RobotModel(config))
    (pair, kept), = geometry.resting(LIMIT).items()
    assert set(pair) == {"base_link", "RARM_LINK5"}
    assert kept < LIMIT
    posture = config.posture(braced)
    at_rest = geometry.self_clearance(moving(posture), LIMIT)
    require_clearance(at_rest, "cam")
    assert at_rest.distance == pytest.approx(kept + 1e-3, abs=1e-6)
    deeper = config.posture({"RARM_JOINT1": braced["RARM_JOINT1"] + math.radians(2.0)}, posture)
    with pytest.raises(PostureUnreachable, match="base_link"):
        require_clearance(geometry.self_clearance(moving(deeper), LIMIT), "cam")


def test_a_mesh_counts_by_its_convex_hull(robot, geometry, tmp_path):
    """An open cube around the head's sphere is as far from a leaf in front of it."""
    half = 0.09
    cube = np.array(list(itertools.product((-half, half), repeat=3)))
    triangles = [cube[face] for face in ConvexHull(cube).simplices[1:]]  # one is missing: open
    with open(tmp_path / "head.stl", "wb") as file:
        file.write(bytes(80) + struct.pack("<I", len(triangles)))
        for triangle in triangles:
            file.write(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0))
    meshed = BodyGeometry(with_head_of_mesh(robot, tmp_path, str(tmp_path / "head.stl")))
    assert meshed.left_out == ()
    assert meshed.pairs == geometry.pairs
    motion = moving(robot.config.half_sitting)
    leaf = wall(motion, (0.2, -0.5), -math.pi / 2)
    touch = set(geometry.links) - {"HEAD_LINK1"}
    sphere, hull = (
        bodies.leaf_clearance(motion, leaf, LIMIT, may_touch=touch) for bodies in (geometry, meshed)
    )
    assert hull.distance == pytest.approx(sphere.distance, abs=1e-6)

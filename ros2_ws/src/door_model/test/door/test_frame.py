"""The frame around a leaf: its numbers, its boxes, and the room that it leaves."""

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from door_model.door.config import door_names, hinge_of, load_door, load_geometry
from door_model.door.frame import THRESHOLD, FixedBox, frame_boxes
from door_model.door.geometry import (
    CLEAR_ANGLE,
    FLOOR_CLEARANCE,
    HIGHEST_THRESHOLD,
    Frame,
    Leaf,
    before,
)
from door_model.errors import ConfigError, DoorParameterError
from hypothesis import given
from hypothesis import strategies as st

FRAME = Frame(0.9, 0.1, 0.14)


@st.composite
def doors(draw: st.DrawFn) -> tuple[Leaf, Frame]:
    """Return a leaf and a frame into which it fits."""
    leaf = Leaf(40.0, draw(st.floats(0.4, 1.5)), draw(st.floats(1.5, 2.5)),
                draw(st.floats(0.02, 0.1)))
    thickness = draw(st.floats(0.02, 0.4))
    depth = thickness * draw(st.floats(0.0, 1.0))
    highest = HIGHEST_THRESHOLD if depth > leaf.room_in_front() else 0.999 * FLOOR_CLEARANCE
    width = leaf.width + draw(st.sampled_from([0.0, 1e-4, 0.004, 0.3]))
    return leaf, Frame(width, depth, thickness, round(draw(st.floats(0.0, highest)), 5))


def plan_of(leaf: Leaf, angle: float) -> np.ndarray:
    """Return the corners of an open leaf from above, (4, 2) [m]."""
    along = np.array([math.cos(angle), -math.sin(angle)])
    back = -leaf.thickness * np.array([math.sin(angle), math.cos(angle)])
    return np.array([0.0 * along, leaf.width * along, leaf.width * along + back, back])


def separation(one: np.ndarray, two: np.ndarray) -> float:
    """Return the largest gap of two convex polygons along a normal of their edges [m].

    It is positive only where they do not touch (theorem of the separating axis).
    """
    edges = np.vstack([polygon - np.roll(polygon, 1, axis=0) for polygon in (one, two)])
    normals = np.column_stack([-edges[:, 1], edges[:, 0]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    first, second = one @ normals.T, two @ normals.T
    gaps = np.maximum(first.min(axis=0) - second.max(axis=0),
                      second.min(axis=0) - first.max(axis=0))
    return float(gaps.max())


def gap_to_leaf(leaf: Leaf, angle: float, box: FixedBox) -> float:
    """Return the largest gap between an open leaf and a box along any direction tried [m]."""
    center, half = np.array(box.center), np.array(box.half)
    corners = center[:2] + half[:2] * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    below = FLOOR_CLEARANCE - (center[2] + half[2])
    above = center[2] - half[2] - leaf.top
    return max(separation(plan_of(leaf, angle), corners), below, above)


@given(door=doors(), share=st.floats(0.0, 1.0))
def test_a_turning_leaf_does_not_touch_its_frame(door: tuple[Leaf, Frame], share: float) -> None:
    """From 0 to 100 deg nothing is nearer than the gaps that were asked for."""
    leaf, frame = door
    gap = 0.5 * (frame.width - leaf.width)
    for box in frame_boxes(leaf, frame):
        least = {"wall_free_side": gap, "lintel": 0.01,
                 THRESHOLD: min(0.005, abs(FLOOR_CLEARANCE - frame.threshold))}
        if frame.threshold >= FLOOR_CLEARANCE:
            least[THRESHOLD] = 0.005
        found = gap_to_leaf(leaf, share * CLEAR_ANGLE, box)
        assert found >= least.get(box.name, 0.005) - 1e-9, box.name


def test_the_rebate_is_needed_and_no_deeper_than_needed() -> None:
    """Without it the corner at the hinge would meet the jamb, and beyond 100 deg it soon does."""
    leaf = load_door("paper").leaf
    boxes = {box.name: box for box in frame_boxes(leaf, FRAME)}
    jamb, wall = boxes["jamb"], boxes["wall_hinge_side"]
    whole = FixedBox("", (jamb.center[0], wall.center[1], 1.0), (jamb.size[0], wall.size[1], 2.0))
    assert gap_to_leaf(leaf, math.radians(30.0), whole) < 0.0
    angles = np.radians(np.arange(0.0, 116.0))
    for box in (jamb, wall):
        gaps = np.array([gap_to_leaf(leaf, angle, box) for angle in angles])
        assert gaps[:101].min() == pytest.approx(0.005, abs=1e-3)
        assert gaps[-1] < 0.0


@given(door=doors(), origin=st.tuples(*[st.floats(-9.0, 9.0)] * 3))
def test_boxes_leave_the_clear_width_and_do_not_overlap(
        door: tuple[Leaf, Frame], origin: tuple[float, float, float]) -> None:
    """Jamb and wall are as far apart as asked for, the wall as thick, and no two boxes overlap."""
    leaf, frame = door
    boxes = {box.name: box for box in frame_boxes(leaf, frame, origin)}
    free, hinge = boxes["wall_free_side"], boxes["wall_hinge_side"]
    left = boxes.get("jamb", hinge)
    clear = free.center[0] - free.half[0] - (left.center[0] + left.half[0])
    assert clear == pytest.approx(frame.width) if "jamb" in boxes else clear > frame.width - 1e-9
    for box in (free, hinge):
        assert box.size == pytest.approx((1.5, frame.wall_thickness, leaf.top + 0.21))
        assert box.center[1] + box.half[1] == pytest.approx(origin[1] + frame.depth)
        assert box.center[2] - box.half[2] == pytest.approx(origin[2])
    if THRESHOLD in boxes:
        box = boxes[THRESHOLD]
        assert box.size[2] == pytest.approx(frame.threshold)
        low = frame.threshold < FLOOR_CLEARANCE  # only a low one reaches through the whole wall
        assert low == (box.size[1] == pytest.approx(frame.wall_thickness))
    for one, two in itertools.combinations(boxes.values(), 2):
        apart = np.abs(np.subtract(one.center, two.center)) - np.add(one.half, two.half)
        assert apart.max() > -1e-9, (one.name, two.name)


@pytest.mark.parametrize(("wrong", "match"), [
    ({"width": 900.0}, r"frame width .*\(mm\?\)"), ({"threshold": 0.031}, "up to 0.03 m"),
    ({"depth": 0.15}, "up to 0.14 m, the wall's thickness, not 0.15"),
    ({"width": 0.8}, "at least the leaf's width of 0.896 m, not 0.8"),
    ({"depth": 0.01, "threshold": 0.02}, "threshold must be below 0.01 m.*not 0.02"),
    ({"height": 2.0}, "frame.height")])
def test_a_frame_that_no_door_has_or_no_leaf_fits_into_is_refused(
        tmp_path: Path, wrong: dict[str, float], match: str) -> None:
    """By the file and by the boxes, with value and limit; so is an unknown key."""
    document = yaml.safe_load(load_door("paper").to_yaml())
    document["frame"] |= wrong
    path = tmp_path / "door.yaml"
    path.write_text(yaml.safe_dump(document))
    for load in (load_door, load_geometry):
        with pytest.raises(ConfigError, match=match):
            load(path)
    if "height" not in wrong:
        with pytest.raises(DoorParameterError, match=match):
            frame_boxes(load_door("paper").leaf, replace(FRAME, **wrong))


@given(width=st.floats(0.01, 3.0))
def test_the_frame_of_another_leaf_has_the_same_gaps(width: float) -> None:
    """The jambs stay 2 mm beside the leaf."""
    other = load_geometry("paper").with_leaf(Leaf(50.0, width, 2.1, 0.04))
    assert other.frame == replace(FRAME, width=other.frame.width)
    assert other.frame.width - other.leaf.width == pytest.approx(0.004, abs=1e-8)


def test_shipped_doors_have_a_frame() -> None:
    """Each leaf has 2 mm on each side; there is no threshold."""
    for name in door_names():
        door = load_door(name)
        assert door.frame.width == pytest.approx(door.leaf.width + 0.004)
        names = {box.name for box in frame_boxes(door.leaf, door.frame)}
        assert names == {"wall_hinge_side", "wall_free_side", "jamb", "lintel"}


@given(doors())
def test_the_frame_of_a_door_hinged_at_the_left_is_the_mirror_image(door: tuple[Leaf, Frame]):
    """Its parts have the same sizes, at -x."""
    right, left = (frame_boxes(*door, hinge=hinge) for hinge in ("right", "left"))
    for one, other in zip(right, left, strict=True):
        assert (one.name, one.size) == (other.name, other.size)
        assert other.center == pytest.approx((-one.center[0], *one.center[1:]))


def test_the_hinge_is_read_written_and_checked(tmp_path: Path):
    """It is at the right where the file does not say it."""
    door, path = load_door("paper"), tmp_path / "door.yaml"
    assert door.hinge == hinge_of("paper") == hinge_of("") == "right"
    path.write_text(replace(door, hinge="left").to_yaml())
    assert load_door(path) == replace(door, hinge="left")
    assert hinge_of(str(path)) == load_geometry(path).hinge == "left"
    path.write_text(door.to_yaml() + "hinge: top\n")
    with pytest.raises(ConfigError, match="hinge"):
        load_door(path)


def test_a_pose_before_a_left_hinge_faces_the_other_way():
    """So y stays opposite to the push."""
    assert before("right", (0.1, 0.2, 0.3)) == (0.1, 0.2, 0.3)
    assert before("left", (0.1, 0.2, 0.3)) == pytest.approx((-0.1, 0.2, math.pi - 0.3))

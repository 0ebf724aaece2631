"""The door for viewers stands where the simulated door stands, and opens like it."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pybullet
import pytest
from door_impact_bringup import door_scene
from door_impact_view.scene.urdf import read_urdf
from door_model.door.config import load_door
from door_model.door.frame import frame_boxes
from door_model.door.geometry import Hinge, along
from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.physics.pybullet.door_frame import FrameBodies
from hrp2_sim_bridge.physics.pybullet.leaf import HINGE, LeafBody
from pybullet_utils.bullet_client import BulletClient

DISTANCE, HINGE_X = 0.715, -0.4056
DOOR = load_door("paper")
SURFACE = ContactDesign(1e5, 1e3, 0.5, 0.015, 47.0)  # has no influence on the place of the leaf


@pytest.fixture
def clients() -> Iterator[tuple[Any, Any]]:
    """Makes two empty worlds."""
    pair = BulletClient(pybullet.DIRECT), BulletClient(pybullet.DIRECT)
    yield pair
    for client in pair:
        client.disconnect()


def hits(client: Any) -> np.ndarray:
    """Returns the points where 60 horizontal and 60 vertical rays meet the door (120, 3) [m]."""
    along = np.linspace(-0.6, 0.6, 60)
    side = [([x, -0.2, 1.0], [x, -2.0, 1.0]) for x in along]
    above = [([x, y, 3.0], [x, y, -1.0]) for x in along[::6] for y in np.linspace(-0.75, -1.4, 6)]
    starts, ends = zip(*side, *above, strict=True)
    return np.array([hit[3] if hit[0] >= 0 else [9.0] * 3
                     for hit in client.rayTestBatch(starts, ends)])


def place(client: Any, pose: door_scene.Pose) -> tuple[Any, Any]:
    """Returns a pose as PyBullet's position and orientation."""
    return client.multiplyTransforms(pose[:3], pose[3:], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize(("hinge", "angle_deg"), [("right", 0.0), ("right", 25.0), ("left", 25.0)])
def test_the_shown_door_is_where_the_simulated_one_is(
        clients: tuple[Any, Any], tmp_path: Path, hinge: Hinge, angle_deg: float) -> None:
    """Rays from the front and from above hit the shown leaf, wall and lintel as the simulated."""
    angle, door, x = math.radians(angle_deg), replace(DOOR, hinge=hinge), along(hinge) * HINGE_X
    simulated, shown = clients
    body = LeafBody(simulated, door, DISTANCE, x, SURFACE).body
    simulated.resetJointState(body, HINGE, angle)
    boxes = frame_boxes(DOOR.leaf, DOOR.frame, (x, -DISTANCE, 0.0), hinge)
    FrameBodies(simulated, boxes, body, 0.3, 0.8)
    path = tmp_path / "door.urdf"
    path.write_text(door_scene.door_urdf(door))
    pose = place(shown, door_scene.frame_pose(DISTANCE, HINGE_X, hinge))
    body = shown.loadURDF(str(path), *pose, useFixedBase=True)
    shown.resetJointState(body, 0, angle)  # which is the same as the leaf's transform, see below
    expected = hits(simulated)
    assert (expected[:, 0] < 9.0).sum() > 20
    np.testing.assert_allclose(hits(shown), expected, atol=1e-6)


@pytest.mark.parametrize("hinge", ["right", "left"])
def test_the_urdfs_joint_opens_like_the_transform(
        clients: tuple[Any, Any], tmp_path: Path, hinge: Hinge) -> None:
    """A viewer that moves the joint door_hinge itself shows the leaf in its pose on /tf."""
    angle_deg = 40.0
    client, _ = clients
    path = tmp_path / "door.urdf"
    path.write_text(door_scene.door_urdf(replace(DOOR, hinge=hinge)))
    door = client.loadURDF(str(path), useFixedBase=True)
    assert client.getJointInfo(door, 0)[1].decode() == "door_hinge"
    client.resetJointState(door, 0, math.radians(angle_deg))
    position, turn = client.getLinkState(door, 0, computeForwardKinematics=True)[4:6]
    row = door_scene.leaf_pose(math.radians(angle_deg), hinge)
    np.testing.assert_allclose([*position, *turn], row, atol=1e-6)


def test_the_description_has_the_boxes_of_the_frame() -> None:
    """Each to be seen and to collide with, in its place; one sees through the wall in a viewer."""
    text = door_scene.door_urdf(DOOR)
    boxes = frame_boxes(DOOR.leaf, DOOR.frame)
    frame = ET.fromstring(text).find(f"link[@name='{door_scene.FRAME}']")
    for kind in ("visual", "collision"):
        found = [(shape.attrib["name"], shape.find("origin").attrib["xyz"],
                  shape.find("geometry/box").attrib["size"]) for shape in frame.findall(kind)]
        assert [name for name, _, _ in found] == [box.name for box in boxes]
        for (_, *texts), box in zip(found, boxes, strict=True):
            numbers = [[*map(float, text.split())] for text in texts]
            np.testing.assert_allclose(numbers, [box.center, box.size], rtol=1e-5)
    shapes = [shape for shape in read_urdf(text).shapes if shape.link == door_scene.FRAME]
    assert [shape.color[3] < 255 for shape in shapes] == [
        box.name.startswith("wall") for box in boxes]

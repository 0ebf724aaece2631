"""Render an animation of a hit from the simulation's log, with PyBullet's software renderer."""

import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_bringup import door_scene
from door_impact_common.arrays import Array
from door_model.door.config import DoorConfig
from door_model.door.geometry import along
from hrp2_sim_bridge.physics.pybullet.client import connect
from PIL import Image, ImageDraw, ImageFont

from door_impact_evaluation.run.simulation_log import SimulationLog

SIZE = (520, 480)  # width and height of a frame [pixel]
FLOOR_COLOUR = (0.80, 0.82, 0.84, 1.0)
LINE_COLOUR = (0.45, 0.47, 0.50, 1.0)
# Without effect here; PyBullet warns of a link that has none.
_INERTIAL = ('<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
             "</inertial>")
# Place of the camera and its target in odom [m]; before a door hinged at the left it is at -x.
CAMERA = ((2.9, -0.1, 1.5), (0.0, -0.5, 0.75))


def hit(log: SimulationLog, door: DoorConfig, contact_time: float, path: Path, *,
        before: float = 1.3, after: float = 5.5, slow_motion: float = 2.0,
        rate: float = 12.5, follow: bool = False) -> None:
    """Write a GIF of the run-up, the hit, the opening, and what follows.

    Args:
        log: The simulation's log as it was, with the place of the door.
        door: The door, for the size of its leaf.
        contact_time: Time of the hit [s].
        path: GIF file to write.
        before: Time before the hit at which the animation begins [s].
        after: Time after the hit at which the animation ends [s].
        slow_motion: Factor by which it plays slower than real time.
        rate: Frames per second of playing [1/s].
        follow: Whether the camera moves along with the robot.
    """
    end = min(contact_time + after, float(log.motion.t[-1]))
    times = np.arange(contact_time - before, end, 1.0 / (rate * slow_motion))
    frames = [_caption(frame, time - contact_time, slow_motion).quantize(96)
              for time, frame in zip(
                  times, _render(log, door, times, follow=follow), strict=True)]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=int(1000 / rate), loop=0,
                   optimize=True)


def _render(
    log: SimulationLog, door: DoorConfig, times: Array, *, follow: bool
) -> Iterator[Image.Image]:
    """Yield the picture at each of some times [s]."""
    client, motion = connect(gui=False), log.motion
    try:
        body = client.loadURDF(str(log.robot.urdf_path), useFixedBase=True)
        inertial = client.getDynamicsInfo(body, -1)[3:5]  # its pose in base_link
        index = {client.getJointInfo(body, i)[1].decode(): i
                 for i in range(client.getNumJoints(body))}
        _box(client, (1.8, 1.6, 0.01), (0.3, -0.6, -0.01), FLOOR_COLOUR)
        # A line on the floor marks the closed leaf, so that the opening angle can be seen.
        half, y = door.leaf.width / 2, -log.door_distance - door.leaf.thickness / 2
        side = along(door.hinge)
        _box(client, (half, 0.012, 0.001), (log.hinge_x + side * half, y, 0.0), LINE_COLOUR)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "door.urdf"
            path.write_text(_visible(door_scene.door_urdf(door)))
            leaf = client.loadURDF(
                str(path), (log.hinge_x, -log.door_distance, 0.0), useFixedBase=True)
        begin = motion.base_position[np.searchsorted(motion.t, times[0])]
        projection = client.computeProjectionMatrixFOV(42.0, SIZE[0] / SIZE[1], 0.1, 10.0)
        for time in times:
            row = min(int(np.searchsorted(motion.t, time)), len(motion.t) - 1)
            client.resetBasePositionAndOrientation(body, *client.multiplyTransforms(
                motion.base_position[row], motion.base_orientation[row], *inertial))
            for name, angle in zip(log.robot.joint_names, motion.joints[row], strict=True):
                client.resetJointState(body, index[name], angle)
            client.resetJointState(leaf, 0, motion.door_angle[row])
            way = follow * (motion.base_position[row] - begin) * [1.0, 1.0, 0.0]
            place = np.array(CAMERA) * [side, 1.0, 1.0] + way
            view = client.computeViewMatrix(*place.tolist(), (0, 0, 1))
            _, _, pixels, _, _ = client.getCameraImage(
                *SIZE, view, projection, lightDirection=(1.5, 1.0, 3.0), shadow=1,
                renderer=client.ER_TINY_RENDERER)
            rgba = np.asarray(pixels, dtype=np.uint8).reshape(SIZE[1], SIZE[0], 4)
            yield Image.fromarray(rgba[:, :, :3])
    finally:
        client.disconnect()


def _visible(urdf: str) -> str:
    """Return a door's URDF without the wall beside the free edge.

    The renderer knows no transparency: that wall would hide the leaf.
    """
    robot = ET.fromstring(urdf)
    for link in robot.iter("link"):
        for shape in link.findall("visual[@name='wall_free_side']"):
            link.remove(shape)
        link.append(ET.fromstring(_INERTIAL))
    return ET.tostring(robot, encoding="unicode")


def _box(client: Any, half: tuple[float, float, float],
         position: tuple[float, float, float], colour: tuple[float, float, float, float]) -> None:
    shape = client.createVisualShape(client.GEOM_BOX, halfExtents=half, rgbaColor=colour)
    client.createMultiBody(0, -1, shape, position)


def _caption(frame: Image.Image, time: float, slow_motion: float) -> Image.Image:
    draw = ImageDraw.Draw(frame)
    draw.text((10, SIZE[1] - 26), f"t = {time:+.2f} s from the impact   (1/{slow_motion:g} speed)",
              fill=(30, 30, 30), font=ImageFont.load_default(16))
    return frame

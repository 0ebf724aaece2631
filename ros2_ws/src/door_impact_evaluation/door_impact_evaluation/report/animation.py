"""Renders an animation of the hit from the simulation's log, with PyBullet's software renderer."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_sim_bridge.physics.pybullet.client import connect
from PIL import Image, ImageDraw, ImageFont

SIZE = (520, 480)  # width and height of a frame [pixel]
FLOOR_COLOUR = (0.80, 0.82, 0.84, 1.0)
LEAF_COLOUR = (0.63, 0.47, 0.30, 1.0)
FRAME_COLOUR = (0.45, 0.47, 0.50, 1.0)
CAMERA = ((2.9, -0.1, 1.5), (0.0, -0.5, 0.75))  # place of the camera and its target, in odom [m]


@dataclass(frozen=True)
class Scene:
    """The robot, the door and its place.

    Attributes:
        urdf: Path of the robot's URDF.
        joint_names: Names of the joints, in the order of the columns of the joint angles.
        leaf: Width, height and thickness of the leaf [m].
        hinge_x: x of the hinge in odom [m].
        door_distance: Distance of the closed leaf's face from the origin of odom [m].
    """

    urdf: str
    joint_names: Sequence[str]
    leaf: tuple[float, float, float]
    hinge_x: float
    door_distance: float


@dataclass(frozen=True)
class Poses:
    """Poses of robot and door over time.

    Attributes:
        t: Sample times (n,) [s].
        joints: Joint angles (n, 30) [rad].
        base_position: Position of base_link in odom (n, 3) [m].
        base_orientation: Orientation of base_link in odom, quaternions x, y, z, w (n, 4).
        door_angle: Opening angle of the door (n,) [rad].
    """

    t: Array
    joints: Array
    base_position: Array
    base_orientation: Array
    door_angle: Array


def hit(scene: Scene, poses: Poses, contact_time: float, path: Path, *, before: float = 1.3,
        after: float = 5.5, slow_motion: float = 2.0, rate: float = 12.5) -> None:
    """Write a GIF of the run-up, the hit, the opening and the hold.

    Args:
        scene: The robot, the door and its place.
        poses: Poses over the whole motion.
        contact_time: Time of the hit [s].
        path: GIF file to write.
        before: Time before the hit at which the animation begins [s].
        after: Time after the hit at which the animation ends [s].
        slow_motion: Factor by which it plays slower than real time.
        rate: Frames per second of playing [1/s].
    """
    end = min(contact_time + after, float(poses.t[-1]))
    times = np.arange(contact_time - before, end, 1.0 / (rate * slow_motion))
    frames = [_caption(frame, time - contact_time, slow_motion).quantize(96)
              for time, frame in zip(times, _render(scene, poses, times), strict=True)]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=int(1000 / rate), loop=0,
                   optimize=True)


def _render(scene: Scene, poses: Poses, times: Array) -> Iterator[Image.Image]:
    client = connect(gui=False)
    try:
        robot, joints, offset, leaf = _build(client, scene)
        view = client.computeViewMatrix(*CAMERA, (0, 0, 1))
        projection = client.computeProjectionMatrixFOV(42.0, SIZE[0] / SIZE[1], 0.1, 10.0)
        for time in times:
            index = min(int(np.searchsorted(poses.t, time)), len(poses.t) - 1)
            origin = client.multiplyTransforms(poses.base_position[index],
                                               poses.base_orientation[index], *offset)
            client.resetBasePositionAndOrientation(robot, *origin)
            for joint, angle in zip(joints, poses.joints[index], strict=True):
                client.resetJointState(robot, joint, angle)
            client.resetBasePositionAndOrientation(leaf, *_leaf_pose(
                client, scene, poses.door_angle[index]))
            _, _, pixels, _, _ = client.getCameraImage(
                *SIZE, view, projection, lightDirection=(1.5, 1.0, 3.0), shadow=1,
                renderer=client.ER_TINY_RENDERER)
            rgba = np.asarray(pixels, dtype=np.uint8).reshape(SIZE[1], SIZE[0], 4)
            yield Image.fromarray(rgba[:, :, :3])
    finally:
        client.disconnect()


def _build(client: Any, scene: Scene) -> tuple[int, list[int], tuple[Array, Array], int]:
    """Load the scene.

    Returns:
        The robot's body, the indices of its joints, the pose of its inertial frame in base_link,
        and the leaf's body.
    """
    robot = client.loadURDF(scene.urdf, useFixedBase=True)
    info = client.getDynamicsInfo(robot, -1)
    joints = range(client.getNumJoints(robot))
    index = {client.getJointInfo(robot, i)[1].decode(): i for i in joints}
    width, height, thickness = scene.leaf
    _box(client, (1.8, 1.6, 0.01), (0.3, -0.6, -0.01), FLOOR_COLOUR)
    y = -scene.door_distance - thickness / 2
    _box(client, (0.035, 0.05, height / 2), (scene.hinge_x - 0.04, y, height / 2), FRAME_COLOUR)
    # A line on the floor marks the closed leaf, so that the opening angle can be seen.
    _box(client, (width / 2, 0.012, 0.001), (scene.hinge_x + width / 2, y, 0.0), FRAME_COLOUR)
    leaf = _box(client, (width / 2, thickness / 2, height / 2), (0, 0, 0), LEAF_COLOUR)
    return robot, [index[name] for name in scene.joint_names], (info[3], info[4]), leaf


def _box(client: Any, half: tuple[float, float, float],
         position: tuple[float, float, float], colour: tuple[float, float, float, float]) -> int:
    shape = client.createVisualShape(client.GEOM_BOX, halfExtents=half, rgbaColor=colour)
    body: int = client.createMultiBody(0, -1, shape, position)
    return body


def _leaf_pose(client: Any, scene: Scene, theta: float) -> tuple[Array, Array]:
    width, height, thickness = scene.leaf
    c, s = np.cos(-theta), np.sin(-theta)  # the door opens about -z
    x, y = width / 2, -thickness / 2
    position = np.array([scene.hinge_x + c * x - s * y, -scene.door_distance + s * x + c * y,
                         height / 2 + 0.01])
    return position, np.array(client.getQuaternionFromEuler((0.0, 0.0, -theta)))


def _caption(frame: Image.Image, time: float, slow_motion: float) -> Image.Image:
    draw = ImageDraw.Draw(frame)
    draw.text((10, SIZE[1] - 26), f"t = {time:+.2f} s from the impact   (1/{slow_motion:g} speed)",
              fill=(30, 30, 30), font=ImageFont.load_default(16))
    return frame

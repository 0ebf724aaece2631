"""Robot, door and the points of balance as nodes of a viser scene.

The links of a URDF become frames that are nested as its joints are, so that only the position of
a moving joint has to be sent.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from door_impact_common.arrays import Array

from door_impact_view.live.state import Pose, State
from door_impact_view.scene import colors
from door_impact_view.scene.capture import CaptureEstimator
from door_impact_view.scene.floor import FLAT, RAISED, on_floor
from door_impact_view.scene.meshes import Mesh
from door_impact_view.scene.poses import joint_pose
from door_impact_view.scene.urdf import SLIDING, TURNING, Shape, UrdfScene

_MOVED = 1e-4  # smallest change of a joint or a place that is sent [rad] or [m]
_HEIGHTS = {"zmp": FLAT, "capture_point": RAISED}  # at which points of the floor are drawn [m]
_METRES_PER_NEWTON = 1.0 / 1000.0  # length of a force's arrow
_LEAST_FORCE = 5.0  # force below which no arrow is drawn [N]


class ModelView:
    """A URDF in the scene.

    Args:
        scene: viser's scene.
        path: Name of its node in the scene, such as ``/robot``.
        model: What to draw.
        meshes: Its meshes by file; one that is not in it is left out.
    """

    def __init__(
        self, scene: Any, path: str, model: UrdfScene, meshes: Mapping[str, Mesh]
    ) -> None:
        self._scene, self._meshes = scene, meshes
        self._paths = {model.root: f"{path}/{_node(model.root)}"}
        self._base = scene.add_frame(self._paths[model.root], show_axes=False)
        self._pose: Pose | None = None
        moving, frames = [], []
        for joint in model.joints:  # parents come before their children
            self._paths[joint.child] = f"{self._paths[joint.parent]}/{_node(joint.child)}"
            frame = scene.add_frame(
                self._paths[joint.child], show_axes=False, position=joint.place,
                wxyz=joint.orientation)
            if joint.kind in TURNING + SLIDING:
                moving.append(joint)
                frames.append(frame)
        self._moving, self._frames = moving, frames
        self._positions = np.zeros(len(moving))
        for number, shape in enumerate(model.shapes):
            self._add(f"{self._paths[shape.link]}/shape{number}", shape)

    def path(self, link: str) -> str | None:
        """Return the name of a link's node in the scene; None if there is no such link."""
        return self._paths.get(link)

    def remove(self) -> None:
        """Remove it from the scene."""
        self._base.remove()

    def place(self, pose: Pose | None) -> None:
        """Put the root link at a pose in the world; None leaves it where it is."""
        if pose is None:
            return
        old = self._pose
        if old is None or np.abs(pose[0] - old[0]).max() > _MOVED:
            self._base.position = pose[0]
        if old is None or np.abs(pose[1] - old[1]).max() > _MOVED:
            self._base.wxyz = pose[1]
        elif old is not None:
            pose = (pose[0], old[1])
        self._pose = pose

    def move(self, positions: Mapping[str, float]) -> int:
        """Move the joints; what is not named, or not finite, stays where it is.

        Args:
            positions: Positions by name of the joint [rad] or [m].

        Returns:
            Number of joints that moved.
        """
        now = np.array([positions.get(joint.name, np.nan) for joint in self._moving])
        # A comparison with NaN is false.
        changed = np.flatnonzero(np.isfinite(now) & (np.abs(now - self._positions) > _MOVED))
        for index in changed:
            joint, frame = self._moving[index], self._frames[index]
            place, orientation = joint_pose(joint, now[index])
            if joint.kind in SLIDING:
                frame.position = place
            else:
                frame.wxyz = orientation
        self._positions[changed] = now[changed]
        return len(changed)

    def _add(self, name: str, shape: Shape) -> None:
        color = tuple(round(255 * value) for value in shape.color[:3])
        look: dict[str, Any] = {
            "position": shape.place, "wxyz": shape.orientation, "color": color,
            "opacity": shape.color[3] if shape.color[3] < 1.0 else None}
        if shape.kind == "box":
            self._scene.add_box(name, dimensions=shape.size, **look)
        elif shape.kind == "cylinder":
            self._scene.add_cylinder(name, radius=shape.size[0], height=shape.size[1], **look)
        elif shape.kind == "sphere":
            self._scene.add_icosphere(name, radius=shape.size[0], subdivisions=2, **look)
        elif shape.file in self._meshes:
            self._scene.add_mesh_simple(
                name, *self._meshes[shape.file], scale=shape.size, side="double",
                flat_shading=True, **look)


class BalanceView:
    """ZMP, CoM, capture point and support polygon in the scene.

    A line hangs from the CoM, which is inside the robot, down to the floor.

    Args:
        scene: viser's scene.
    """

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._capture = CaptureEstimator()
        self._points = {
            name: scene.add_icosphere(
                f"/balance/{name}", radius=radius, color=color, subdivisions=2, visible=False)
            for name, radius, color in (
                ("zmp", 0.025, colors.ZMP), ("com", 0.035, colors.COM),
                ("capture_point", 0.018, colors.CAPTURE_POINT))}
        self._plumb = scene.add_line_segments(
            "/balance/com/plumb", np.zeros((1, 2, 3)), colors.COM, thickness=0.01)
        self._height = 0.0  # of the CoM above the floor [m]
        self._polygon = scene.add_line_segments(
            "/balance/support_polygon", np.zeros((1, 2, 3)), colors.SUPPORT, thickness=0.008,
            visible=False)
        self._corners = np.zeros((0, 2))

    def show(self, state: State) -> None:
        """Move every point; one that is not known, or is old, is hidden."""
        zmp, com = state.fresh(state.zmp), state.fresh(state.com)
        capture = None
        if com is not None and state.com is not None:
            capture = self._capture.update(state.com.time, com)
        self._put("zmp", zmp)
        self._put("com", com)
        if com is not None and abs(com[2] - self._height) > 10.0 * _MOVED:
            self._height = float(com[2])
            self._plumb.points = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, -self._height]]])
        self._put("capture_point", capture)
        corners = state.fresh(state.polygon)
        shown = corners is not None and len(corners) >= 3
        if self._polygon.visible != shown:
            self._polygon.visible = shown
        if corners is None or not shown:
            return
        if corners.shape != self._corners.shape or np.abs(corners - self._corners).max() > _MOVED:
            self._corners = corners
            raised = on_floor(corners)
            self._polygon.points = np.stack([raised, np.roll(raised, -1, axis=0)], axis=1)

    def _put(self, name: str, place: Array | None) -> None:
        point = self._points[name]
        if point.visible != (place is not None):
            point.visible = place is not None
        if place is not None:
            point.position = (*place, *([_HEIGHTS[name]] if len(place) == 2 else ()))


class ForceView:
    """Arrows of the forces on feet and hands, in the frames of their links.

    An arrow ends where the force acts: what begins there would be hidden in the robot, because
    the surroundings push.

    Args:
        scene: viser's scene.
        model: The robot in it.
    """

    def __init__(self, scene: Any, model: ModelView) -> None:
        self._scene, self._model = scene, model
        self._arrows: dict[str, Any] = {}

    def show(self, state: State) -> None:
        """Draw the arrows of all forces that are known and not small."""
        for link, item in state.forces.items():
            force = state.fresh(item)
            length = 0.0 if force is None else float(np.linalg.norm(force))
            arrow = self._arrows.get(link) or self._add(link)
            if arrow is None:
                continue
            if arrow.visible != (length > _LEAST_FORCE):
                arrow.visible = length > _LEAST_FORCE
            if force is not None and arrow.visible:
                start = -force * _METRES_PER_NEWTON
                if np.abs(start - arrow.points[0, 0]).max() > 10.0 * _MOVED:
                    arrow.points = np.array([[start, np.zeros(3)]])

    def _add(self, link: str) -> Any:
        path = self._model.path(link)
        if path is None:
            return None
        self._arrows[link] = self._scene.add_arrows(
            f"{path}/force", np.zeros((1, 2, 3)), colors.FORCE, shaft_radius=0.012,
            head_radius=0.03, head_length=0.06, visible=False)
        return self._arrows[link]


def _node(link: str) -> str:
    """Return a link's name without the character that separates nodes."""
    return link.replace("/", "_")

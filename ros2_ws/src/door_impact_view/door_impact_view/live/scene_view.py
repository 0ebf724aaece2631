"""Draw robot, door, forces, ZMP, CoM and capture point as nodes of a viser scene."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
import viser
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from viser.extras import ViserUrdf

from door_impact_view.live.state import Body, State
from door_impact_view.scene import colors
from door_impact_view.scene.poses import FLAT, RAISED, on_floor, rotate
from door_impact_view.scene.urdf import UrdfScene

WINDOW = 0.1  # time over which the CoM's velocity is taken; its delay is half of that [s]
_ENOUGH = 3  # samples for a velocity
_MOVED = 1e-4  # smallest change of a joint or a place that is sent [rad] or [m]
_HEIGHTS = {"zmp": FLAT, "capture_point": RAISED}  # at which points of the floor are drawn [m]
_METRES_PER_NEWTON = 1.0 / 1000.0  # length of a force's arrow
_LEAST_FORCE = 5.0  # force below which no arrow is drawn [N]


class BodyView:
    """Robot or door in the scene.

    Args:
        server: viser's server.
        path: Name of its node in the scene, such as ``/robot``.
    """

    def __init__(self, server: viser.ViserServer, path: str) -> None:
        self._server, self._path = server, path
        self._frame = server.scene.add_frame(path, show_axes=False)
        self._scene: UrdfScene | None = None
        self._drawn: ViserUrdf | None = None
        self._positions = np.zeros(0)

    def show(self, body: Body) -> None:
        """Draw a body where it is; what is not known, or not finite, stays where it was."""
        if body.scene is not self._scene and body.scene is not None:
            self._frame.remove()
            self._frame = self._server.scene.add_frame(self._path, show_axes=False)
            self._scene = body.scene
            self._drawn = ViserUrdf(self._server, body.scene.urdf, root_node_name=self._path)
            self._positions = np.zeros(len(self._drawn.get_actuated_joint_names()))
            self._drawn.update_cfg(self._positions)
        if self._drawn is None:
            return
        if body.pose is not None:
            self._frame.position, self._frame.wxyz = body.pose
        now = np.array([body.joints.get(name, np.nan)
                        for name in self._drawn.get_actuated_joint_names()])
        now = np.where(np.isfinite(now), now, self._positions)
        if np.abs(now - self._positions).max(initial=0.0) > _MOVED:
            self._positions = now
            self._drawn.update_cfg(now)


class BalanceView:
    """ZMP, CoM, capture point and support polygon in the scene.

    A line hangs from the CoM, which is inside the robot, down to the floor.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
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
        com = state.fresh(state.com)
        capture = None
        if com is not None and state.com is not None:
            capture = self._capture.update(state.com.time, com)
            if abs(com[2] - self._height) > 10.0 * _MOVED:
                self._height = float(com[2])
                self._plumb.points = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, -self._height]]])
        for name, place in (
                ("zmp", state.fresh(state.zmp)), ("com", com), ("capture_point", capture)):
            self._points[name].visible = place is not None
            if place is not None:
                height = [_HEIGHTS[name]] if len(place) == 2 else []
                self._points[name].position = np.array([*place, *height])
        corners = state.fresh(state.polygon)
        self._polygon.visible = corners is not None and len(corners) >= 3
        if corners is None or not self._polygon.visible:
            return
        if corners.shape != self._corners.shape or np.abs(corners - self._corners).max() > _MOVED:
            self._corners = corners
            raised = on_floor(corners)
            self._polygon.points = np.stack([raised, np.roll(raised, -1, axis=0)], axis=1)


class FootstepView:
    """Outlines of the soles that will stand on the floor."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._lines = scene.add_line_segments(
            "/footsteps", np.zeros((1, 2, 3)), colors.SUPPORT, thickness=0.006, visible=False)
        self._shown = np.zeros((0, 4, 2))

    def show(self, state: State) -> None:
        """Draw the footsteps of the walk that is being made."""
        steps = state.footsteps
        self._lines.visible = bool(len(steps))
        if len(steps) and not np.array_equal(steps, self._shown):
            self._shown = steps
            corners = on_floor(steps.reshape(-1, 2)).reshape(-1, 4, 3)
            edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)
            self._lines.points = edges.reshape(-1, 2, 3).astype(np.float32)


class ForceView:
    """Arrows of the forces on feet and hands.

    An arrow ends where the force acts: what begins there would be hidden in the robot, because
    the surroundings push.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        self._arrows = scene.add_arrows(
            "/forces", np.zeros((1, 2, 3)), colors.FORCE, shaft_radius=0.012, head_radius=0.03,
            head_length=0.06, visible=False)

    def show(self, state: State) -> None:
        """Draw the arrows of all forces that are known and not small; the robot is drawn already.

        Args:
            state: The state; its robot's model is in the posture that is shown.
        """
        robot, arrows = state.robot, []
        for link, item in state.forces.items():
            force = state.fresh(item)
            if (force is None or np.linalg.norm(force) < _LEAST_FORCE or robot.scene is None
                    or robot.pose is None or link not in robot.scene.links):
                continue
            link_in_base = robot.scene.urdf.get_transform(link)
            end = robot.pose[0] + rotate(robot.pose[1], link_in_base[:3, 3])
            length = _METRES_PER_NEWTON * rotate(robot.pose[1], link_in_base[:3, :3] @ force)
            arrows.append([end - length, end])
        self._arrows.visible = bool(arrows)
        if arrows:
            self._arrows.points = np.array(arrows)


class CaptureEstimator:
    """The capture point of a linear inverted pendulum, from one CoM after another.

    It is x + v / omega0 with omega0 = sqrt(g / z): place x, velocity v and height z of the CoM
    (J. Pratt, J. Carff, S. Drakunov, A. Goswami, *Capture point: a step toward humanoid push
    recovery*, Humanoids 2006, eq. (9)). The velocity is the slope of the least-squares line
    through the samples of `WINDOW`.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[float, Array]] = deque()

    def update(self, time: float, com: Array) -> Array | None:
        """Take a sample, and return the capture point.

        Args:
            time: Stamp [s]; a stamp of before the last one begins anew.
            com: The CoM in a frame with z up and 0 on the floor, (3,) [m].

        Returns:
            x and y, (2,) [m]; None as long as the samples cover too little time.
        """
        samples = self._samples
        if samples and time < samples[-1][0]:
            samples.clear()
        if not samples or time > samples[-1][0]:
            samples.append((time, com))
        while time - samples[0][0] > WINDOW:
            samples.popleft()
        if len(samples) < _ENOUGH:
            return None
        times = np.array([stamp for stamp, _ in samples])
        places = np.array([place[:2] for _, place in samples])
        moved = times - times.mean()
        velocity = moved @ places / (moved @ moved)
        return np.asarray(com[:2] + velocity * math.sqrt(max(float(com[2]), 0.0) / GRAVITY))

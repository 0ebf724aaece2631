"""Subscribe to what the view shows, and keep the messages as bytes until they are drawn."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from action_msgs.msg import GoalStatus, GoalStatusArray
from door_impact_common.node import GuardedNode
from door_impact_common.stamps import seconds
from door_impact_msgs.msg import ImpactPlan
from geometry_msgs.msg import PointStamped, PolygonStamped, WrenchStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from door_impact_view.errors import UrdfError
from door_impact_view.live.panels import Name
from door_impact_view.live.state import Body, PlanSummary, Pose, Stamped, State
from door_impact_view.ros.operator import ACTIONS
from door_impact_view.scene.poses import rotate
from door_impact_view.scene.urdf import read_urdf

# Of a message that comes often only the last counts, and a lost one is followed by the next.
_LAST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Several nodes publish transforms: the last one need not be that of the robot's root.
_TRANSFORMS = QoSProfile(depth=16, reliability=ReliabilityPolicy.BEST_EFFORT)
_STATIC = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_HANDS = ("left_wrist/wrench", "right_wrist/wrench")
_UNDER_WAY = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)
_STATUS, _FEEDBACK = "/_action/status", "/_action/feedback"
_MOTIONS: dict[Name, str] = {"hit": "hit", "walk": "walk", "pass": "way through the door"}
_SPEED_OVER = 2.0  # real time over which the speed of the graph's clock is taken [s]
_TOPICS: tuple[tuple[Any, str, QoSProfile], ...] = (
    *((GoalStatusArray, action + _STATUS, _LATCHED) for _, action in ACTIONS.values()),
    *((kind.Impl.FeedbackMessage, action + _FEEDBACK, _LAST) for kind, action in ACTIONS.values()),
    (String, "robot_description", _LATCHED),
    (String, "door_description", _LATCHED),
    (ImpactPlan, "door_impact_plan", _LATCHED),
    (MarkerArray, "footstep_markers", _LATCHED),
    (Bool, "sim/paused", _LATCHED),
    (TFMessage, "/tf_static", _STATIC),
    (TFMessage, "/tf", _TRANSFORMS),
    (JointState, "joint_states", _LAST),
    (JointState, "door_angle", _LAST),
    (Imu, "imu", _LAST),
    (PointStamped, "zmp", _LAST),
    (PointStamped, "com", _LAST),
    (PolygonStamped, "support_polygon", _LAST),
    *((WrenchStamped, topic, _LAST)
      for topic in ("left_foot/wrench", "right_foot/wrench", *_HANDS)),
)


class Watcher:
    """Subscribes while somebody watches, and makes the state of what has come.

    Args:
        node: The node.
        world: Name of the frame in which everything is drawn.
        prefix: Text before the names of all frames in messages.
        warn: Takes a sentence about a message that cannot be used.
    """

    def __init__(
        self, node: GuardedNode, world: str, prefix: str, warn: Callable[[str], None]
    ) -> None:
        self._node, self._world, self._prefix, self._warn = node, world, prefix, warn
        self._subscriptions: list[Any] = []
        self._inbox: dict[str, deque[Any]] = {}
        self._poses: dict[str, Pose] = {}  # of frames in the world, by name
        self._goals: dict[Name, dict[bytes, float]] = {}  # stamps [s] of those under way
        self._progress: dict[bytes, str] = {}  # of the last goal that told any
        self._footsteps: Stamped | None = None  # corners of the soles, (N, 4, 2) [m]
        self._clock: deque[tuple[float, float]] = deque()  # real time and that of the graph [s]
        self._state = State()

    def watch(self, watching: bool) -> None:
        """Subscribe to everything, or to nothing; what moves is then forgotten."""
        if watching == bool(self._subscriptions):
            return
        if watching:
            for kind, topic, qos in _TOPICS:
                inbox = self._inbox[topic] = deque(maxlen=qos.depth)
                self._subscriptions.append(self._node.create_subscription(
                    kind, topic, lambda data, to=inbox: to.append(data), qos, raw=True))
            return
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()
        robot, door = (Body(body.text, body.scene, body.problem)
                       for body in (self._state.robot, self._state.door))
        self._state = State(robot=robot, door=door, plan=self._state.plan)
        for kept in (self._poses, self._goals, self._clock):
            kept.clear()

    def update(self) -> State:
        """Read what has come since the last time, and return the state."""
        for kind, topic, _ in _TOPICS:
            kept = self._inbox[topic]
            while kept:
                # The newest first, because it makes the others needless; all of those that last.
                data = kept.popleft() if topic == "/tf_static" else kept.pop()
                try:
                    enough = self._read(topic, deserialize_message(data, kind))
                except (ValueError, IndexError, TypeError) as error:
                    self._warn(f"a message on {topic} cannot be shown: {error}")
                    continue
                if enough:
                    kept.clear()
        # Only now: a description may come after the only message with the place.
        for body in (self._state.robot, self._state.door):
            body.pose = self._poses.get(_root(body))
        self._tell_motion()
        self._measure_speed()
        return self._state

    def _tell_motion(self) -> None:
        """Say what the robot is doing, from the goals that are under way."""
        for name, (_, action) in ACTIONS.items():
            if not self._node.count_publishers(action + _STATUS):
                self._goals.pop(name, None)  # its node has gone, and the goals with it
        self._state.moving = frozenset(name for name, goals in self._goals.items() if goals)
        self._state.phase = "; ".join(
            f"{_MOTIONS[name]}: {self._progress.get(goal, 'is being prepared')}"
            for name, goals in self._goals.items() for goal in goals)
        begun = min((stamp for goals in self._goals.values() for stamp in goals.values()),
                    default=math.inf)
        self._state.footsteps = np.zeros((0, 4, 2)) if (
            self._footsteps is None or self._footsteps.time < begun) else self._footsteps.value

    def _measure_speed(self) -> None:
        """Compare the graph's clock with real time."""
        now, clock = self._state.now, self._clock
        if now is None:
            return
        if clock and now < clock[-1][1]:
            clock.clear()  # the simulation was started again
        clock.append((time.monotonic(), now))
        while clock[-1][0] - clock[0][0] > _SPEED_OVER:
            clock.popleft()
        real = clock[-1][0] - clock[0][0]
        self._state.speed = (now - clock[0][1]) / real if real > 0.5 * _SPEED_OVER else None

    def _read(self, topic: str, message: Any) -> bool:
        """Put a message into the state; return whether older ones of its topic do not matter."""
        state = self._state
        match topic:
            case "robot_description":
                _describe(state.robot, message.data)
            case "door_description":
                _describe(state.door, message.data)
            case "door_impact_plan":
                state.plan = plan_summary(message)
            case "/tf" | "/tf_static":
                found = _poses(message, self._world, self._prefix)
                self._poses.update(found)
                return topic == "/tf" and _root(state.robot) in found
            case "joint_states":
                state.robot.joints = _positions(message)
                state.now = seconds(message.header.stamp)
            case "door_angle":
                state.door.joints = _positions(message)
                state.door_angle = _stamped(message, message.position[:1]) if (
                    message.position) else None
            case "sim/paused":
                state.paused = message.data
            case "imu":
                rate, force = message.angular_velocity, message.linear_acceleration
                state.imu = _stamped(message, [rate.x, rate.y, rate.z, force.x, force.y, force.z])
            case "zmp":
                state.zmp = _stamped(message, [message.point.x, message.point.y])
            case "com":
                place = message.point
                state.com = _stamped(message, [place.x, place.y, place.z])
            case "support_polygon":
                corners = [[corner.x, corner.y] for corner in message.polygon.points]
                state.polygon = _stamped(message, np.reshape(corners, (-1, 2)))
            case "footstep_markers":
                self._footsteps = _soles(message)
            case _ if topic.endswith(_STATUS):
                name = _order(topic, _STATUS)
                self._goals[name] = {
                    bytes(each.goal_info.goal_id.uuid): seconds(each.goal_info.stamp)
                    for each in message.status_list if each.status in _UNDER_WAY}
            case _ if topic.endswith(_FEEDBACK):
                self._progress = {bytes(message.goal_id.uuid): progress(message.feedback)}
            case _:
                force = message.wrench.force
                link = message.header.frame_id.removeprefix(self._prefix)
                state.forces[link] = _stamped(message, [force.x, force.y, force.z])
                if topic in _HANDS:
                    state.hands |= {link}
        return True


def progress(feedback: Any) -> str:
    """Return how far an action has come, by its feedback."""
    step = f"step {feedback.step} of {feedback.steps}" if hasattr(feedback, "step") else ""
    if not hasattr(feedback, "phase"):
        return step
    done = (f"{100.0 * feedback.progress:.0f} %" if not step else feedback.hit_phase or step)
    return f"{feedback.phase}, {done}"


def plan_summary(message: Any) -> PlanSummary:
    """Return what the page shows of an ImpactPlan."""
    std = math.degrees(message.peak_angle_std)
    rows = (
        ("plan", message.plan_id),
        ("door", message.door),
        ("desired angle", f"{math.degrees(message.desired_opening_angle):.1f} deg"),
        ("run-up, ending", f"{message.run_up}, {message.ending}"),
        ("w' of the door", f"{message.omega_door:.3f} rad/s"),
        ("v_rB before the hit", f"{message.v_rb:.3f} m/s"),
        ("v'_rB after the hit", f"{message.v_rb_post:.3f} m/s"),
        ("effective mass", f"{message.effective_mass:.1f} kg"),
        ("restitution", f"{message.restitution:.2f}"),
        ("peak force", f"{message.peak_force:.0f} N"),
        ("largest angle", f"{math.degrees(message.peak_angle):.1f} ± {std:.1f} deg"),
        ("time of it after the hit", f"{message.peak_time:.2f} s"),
        ("hits learned from", str(message.learned_hits)),
    )
    margins = tuple((item.phase, float(item.margin)) for item in message.zmp_margins)
    return PlanSummary(rows, margins, tuple(message.warnings))


def _order(topic: str, ending: str) -> Name:
    """Return the order whose action has a topic."""
    return next(name for name, (_, action) in ACTIONS.items() if topic == action + ending)


def _root(body: Body) -> str:
    return "" if body.scene is None else body.scene.root


def _describe(body: Body, text: str) -> None:
    """Read the URDF of a body if it is another one; what was drawn before stays if it is none."""
    if text == body.text:
        return
    body.text = text
    try:
        body.scene = read_urdf(text)
        body.problem = body.scene.note
    except UrdfError as error:
        body.problem = str(error)


def _positions(message: Any) -> dict[str, float]:
    """Return the positions of a JointState by name [rad] or [m]."""
    return dict(zip(message.name, message.position, strict=True))


def _stamped(message: Any, values: Any) -> Stamped:
    """Return values of a message with its stamp; an error if one is not finite."""
    row = np.array(values, dtype=np.float64)
    if not np.isfinite(row).all():
        raise ValueError("a number in it is not finite")
    return Stamped(seconds(message.header.stamp), row)


def _soles(message: Any) -> Stamped | None:
    """Return the corners of the boxes in a MarkerArray as seen from above, or None without any."""
    boxes = [each for each in message.markers if each.type == Marker.CUBE and not each.action]
    if not boxes:
        return None
    unit = 0.5 * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    corners = []
    for box in boxes:
        place, turn, size = box.pose.position, box.pose.orientation, box.scale
        arms = rotate(np.tile([turn.w, turn.x, turn.y, turn.z], (4, 1)),
                      unit * [size.x, size.y, size.z])
        corners.append(arms[:, :2] + [place.x, place.y])
    return _stamped(boxes[0], corners)


def _poses(message: Any, world: str, prefix: str) -> dict[str, Pose]:
    """Return the poses of a TFMessage's frames in the world, by name without the prefix."""
    found = {}
    for transform in message.transforms:
        if transform.header.frame_id.removeprefix("/") != prefix + world:
            continue
        to, turn = transform.transform.translation, transform.transform.rotation
        pose = np.array([to.x, to.y, to.z, turn.w, turn.x, turn.y, turn.z])
        length = float(np.linalg.norm(pose[3:]))
        if not np.isfinite(pose).all() or length < 0.5:
            raise ValueError("a pose in it is not finite, or its orientation is no quaternion")
        found[transform.child_frame_id.removeprefix(prefix)] = pose[:3], pose[3:] / length
    return found

"""The topics that the view shows. Messages are kept as bytes until they are drawn."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from door_impact_common.node import GuardedNode
from door_impact_common.stamps import seconds
from door_impact_msgs.msg import ImpactPlan
from geometry_msgs.msg import PointStamped, PolygonStamped, WrenchStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from door_impact_view.live.state import Pose, State
from door_impact_view.ros import messages

# Of a message that comes often only the last counts, and a lost one is followed by the next.
_LAST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Several nodes publish transforms: the last one need not be that of the robot's root.
_SEVERAL = 16
_TRANSFORMS = QoSProfile(depth=_SEVERAL, reliability=ReliabilityPolicy.BEST_EFFORT)
_STATIC = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_FEET = ("left_foot", "right_foot")
_HANDS = ("left_wrist", "right_wrist")


class Watcher:
    """Subscribes while somebody watches, and makes the state of what has come.

    Args:
        node: The node.
        world: Name of the frame in which everything is drawn.
        warn: Takes a sentence about a message that cannot be used.
    """

    def __init__(self, node: GuardedNode, world: str, warn: Callable[[str], None]) -> None:
        self._node, self._world, self._warn = node, world, warn
        self._subscriptions: list[Any] = []
        self._inbox: dict[str, deque[tuple[Any, bytes]]] = {}
        self._poses: dict[str, Pose] = {}  # of frames in the world, by name
        self.state = State()

    @property
    def watching(self) -> bool:
        """Whether it subscribes."""
        return bool(self._subscriptions)

    def start(self) -> None:
        """Subscribe to everything."""
        take: list[tuple[Any, str, QoSProfile]] = [
            (String, "/robot_description", _LATCHED),
            (String, "/door_description", _LATCHED),
            (ImpactPlan, "/door_impact_plan", _LATCHED),
            (TFMessage, "/tf_static", _STATIC),
            (TFMessage, "/tf", _TRANSFORMS),
            (JointState, "/joint_states", _LAST),
            (JointState, "/door_angle", _LAST),
            (PointStamped, "/zmp", _LAST),
            (PointStamped, "/com", _LAST),
            (PolygonStamped, "/support_polygon", _LAST),
            *((WrenchStamped, f"/{name}/wrench", _LAST) for name in (*_FEET, *_HANDS)),
        ]
        for kind, topic, qos in take:
            self._inbox[topic] = deque(maxlen=qos.depth)
            self._subscriptions.append(self._node.create_subscription(
                kind, topic, partial(self._store, topic, kind), qos, raw=True))

    def stop(self) -> None:
        """Subscribe to nothing; what moves is forgotten, and what does not move is kept."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()
        self._inbox.clear()
        known = self.state
        self.state = State(robot=known.robot, door=known.door, plan=known.plan)
        self._poses.clear()

    def update(self) -> State:
        """Read what has come since the last time, and return the state."""
        for topic, kept in self._inbox.items():
            while kept:
                # The newest first, because it makes the others needless; all of those that last.
                kind, data = kept.popleft() if topic == "/tf_static" else kept.pop()
                try:
                    enough = self._read(topic, deserialize_message(data, kind))
                except (ValueError, IndexError, TypeError) as error:
                    self._warn(f"a message on {topic} cannot be shown: {error}")
                    continue
                if enough:
                    kept.clear()
        # Only now: a description may come after the only message with the place.
        state = self.state
        state.base = self._poses.get(messages.root_of(state.robot))
        state.door_frame = self._poses.get(messages.root_of(state.door))
        return state

    def _store(self, topic: str, kind: Any, data: bytes) -> None:
        if topic in self._inbox:
            self._inbox[topic].append((kind, data))

    def _read(self, topic: str, message: Any) -> bool:
        """Put a message into the state; return whether older ones of its topic do not matter."""
        state = self.state
        match topic:
            case "/robot_description":
                state.robot = message.data
            case "/door_description":
                state.door = message.data
            case "/door_impact_plan":
                state.plan = messages.plan_summary(message)
            case "/tf":
                poses = messages.poses(message, self._world)
                root = messages.root_of(state.robot)
                if root not in poses:
                    return False
                self._poses[root] = poses[root]
            case "/tf_static":
                self._poses.update(messages.poses(message, self._world))
                return False  # each node publishes its own
            case "/joint_states":
                state.joints = messages.positions(message)
                state.now = seconds(message.header.stamp)
            case "/door_angle":
                state.door_joints = messages.positions(message)
                state.door_angle = messages.first_position(message)
            case "/zmp":
                state.zmp = messages.point(message, 2)
            case "/com":
                state.com = messages.point(message, 3)
            case "/support_polygon":
                state.polygon = messages.polygon(message)
            case _:
                link, force = messages.force(message)
                state.forces[link] = force
                if topic.strip("/").partition("/")[0] in _HANDS:
                    state.hands |= {link}
        return True

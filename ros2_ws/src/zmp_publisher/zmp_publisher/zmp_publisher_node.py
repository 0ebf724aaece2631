"""Node ``zmp_publisher``: ZMP, CoM, /tf, diagnostics from joint angles and foot wrenches alone."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError, SettingError
from door_impact_common.node import run_node
from geometry_msgs.msg import PointStamped, PolygonStamped, WrenchStamped
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.kinematics import RobotKinematics, pose_row
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from zmp_publisher import messages as zmp_messages
from zmp_publisher.odometry import FootOdometry, RobotPose
from zmp_publisher.stamp_pairing import StampPairer
from zmp_publisher.zmp_estimator import ZmpEstimator, ZmpReading

PARAMETERS: dict[str, tuple[Any, str]] = {
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "world_frame": ("odom", "frame of what is published and parent of base_link"),
    "threshold": (0.2, "share of the weight below which /zmp is silent"),
    "support_share": (0.05, "a sole that bears more than this share of the weight is support"),
    "hysteresis": (0.05, "the other sole takes over above the share 0.5 + hysteresis of the load"),
    "warn_margin": (0.01, "margin below which diagnostics warn [m]"),
    "tf_rate": (50.0, "transforms, CoMs and polygons a second [Hz], 0 for none"),
    "diagnostics_rate": (10.0, "diagnostics a second [Hz]"),
    "reliability": ("reliable", "of the three subscriptions: reliable or best_effort"),
}
JOINTS = "joints"
QUEUE = 50


class ZmpPublisher(Node):
    """Pairs joint states and wrenches by stamp; everything else is in the library."""

    def __init__(self) -> None:
        super().__init__("zmp_publisher")
        for name, (default, text) in PARAMETERS.items():
            # Rates may come as integers: types are checked below.
            described = ParameterDescriptor(description=text, read_only=True, dynamic_typing=True)
            self.declare_parameter(name, default, described)
        self._world: str = self._text("world_frame")
        self._warn_margin = self._number("warn_margin")
        self._tf_period = _period_ns("tf_rate", self._number("tf_rate"))
        diagnostics_rate = self._number("diagnostics_rate")
        if not diagnostics_rate > 0.0:
            raise SettingError("diagnostics_rate", diagnostics_rate, "positive")

        self._robot = load_robot_config(self._text("robot_config") or None)
        self._kinematics = RobotKinematics(self._robot)
        weight = self._robot.mass * GRAVITY
        share = self._number("support_share")
        threshold = self._number("threshold")
        self._zmp = ZmpEstimator(
            weight, self._robot.soles, threshold=threshold, support_share=share
        )
        self._odometry = FootOdometry(
            self._kinematics,
            loaded_force=share * weight,
            hysteresis=self._number("hysteresis"),
        )
        self._pairer: StampPairer[Any] = StampPairer((JOINTS, *SIDES), capacity=QUEUE)
        self._stamp = -1
        self._tf_stamp = -1
        self._fresh = 0
        self._reading: ZmpReading | None = None
        self._pose: RobotPose | None = None
        self._names: tuple[str, ...] = ()
        self._columns: list[int] = []

        self._zmp_publisher = self.create_publisher(PointStamped, "zmp", 10)
        self._tf_publisher = self.create_publisher(TFMessage, "/tf", 100)
        self._com_publisher = self.create_publisher(PointStamped, "com", 10)
        self._polygon_publisher = self.create_publisher(PolygonStamped, "support_polygon", 10)
        self._marker_publisher = self.create_publisher(MarkerArray, "balance_markers", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        qos = QoSProfile(depth=QUEUE, reliability=_reliability(self._text("reliability")))
        self.create_subscription(JointState, "joint_states", partial(self._take, JOINTS), qos)
        for side in SIDES:
            take = partial(self._take, side)
            self.create_subscription(WrenchStamped, f"{side}_foot/wrench", take, qos)
        self.create_timer(1.0 / diagnostics_rate, self._publish_diagnostics)

    def _number(self, name: str) -> float:
        value = self.get_parameter(name).value
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise SettingError(name, value, "a finite number")
        return float(value)

    def _text(self, name: str) -> str:
        return str(self.get_parameter(name).value)

    def _take(self, stream: str, message: Any) -> None:
        stamp = message.header.stamp
        together = self._pairer.add(stream, stamp.sec * 1_000_000_000 + stamp.nanosec, message)
        if together is not None:
            self._process(together[JOINTS], {side: together[side].wrench for side in SIDES})

    def _process(self, joints: Any, wrenches: dict[str, Any]) -> None:
        stamp = joints.header.stamp
        time = stamp.sec * 1_000_000_000 + stamp.nanosec
        if time < self._stamp:
            self.get_logger().info(
                "time jumped backwards: odom is fixed anew", throttle_duration_sec=1.0
            )
            self._odometry.reset()
            self._tf_stamp = -1
        self._stamp = time
        rows = {side: zmp_messages.wrench_row(wrench) for side, wrench in wrenches.items()}
        forces = {side: float(row[2]) for side, row in rows.items()}
        self._reading, self._pose = None, None
        try:
            self._pose = self._odometry.update(self._positions(joints), forces)
            if self._pose is not None:
                self._reading = self._zmp.read(self._pose.soles, rows)
        except DoorImpactError as error:
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return
        self._fresh += 1
        if self._reading is not None:
            place = self._reading.point
            self._zmp_publisher.publish(zmp_messages.point(stamp, self._world, place))
        if self._pose is not None and self._tf_due(time):
            self._tf_stamp = time
            self._publish_scene(stamp, self._pose, self._reading)

    def _positions(self, joints: Any) -> list[float]:
        names = tuple(joints.name)
        if names != self._names:
            missing = [name for name in self._robot.joint_names if name not in names]
            if missing:
                raise SettingError("joint_states", f"without {missing[0]}", "30 joints of HRP-2")
            self._columns = [names.index(name) for name in self._robot.joint_names]
            self._names = names
        if len(joints.position) != len(names):
            raise SettingError("joint_states", len(joints.position), f"{len(names)} positions")
        return [joints.position[column] for column in self._columns]

    def _tf_due(self, time: int) -> bool:
        # A sample may come a little before its time: half a millisecond counts as on time.
        due = self._tf_stamp < 0 or time - self._tf_stamp >= self._tf_period - 500_000
        return due and self._tf_period > 0

    def _publish_scene(self, stamp: Any, pose: RobotPose, reading: ZmpReading | None) -> None:
        # 37 transforms are most of this node's work: all this is made only for who listens.
        if _heard(self._tf_publisher):
            rows = [pose_row(pose.base), *self._kinematics.link_transforms()]
            frames = [(self._world, "base_link"), *self._kinematics.tree]
            self._tf_publisher.publish(zmp_messages.transforms(stamp, frames, rows))
        if reading is not None and _heard(self._polygon_publisher):
            polygon = zmp_messages.polygon(stamp, self._world, reading.polygon)
            self._polygon_publisher.publish(polygon)
        if not (_heard(self._com_publisher) or _heard(self._marker_publisher)):
            return
        com = pose.base[:3, :3] @ self._kinematics.com() + pose.base[:3, 3]
        if _heard(self._com_publisher):
            self._com_publisher.publish(zmp_messages.point(stamp, self._world, com))
        if _heard(self._marker_publisher):
            places = {"zmp": None if reading is None else reading.point, "com": com}
            self._marker_publisher.publish(zmp_messages.markers(stamp, self._world, places))

    def _publish_diagnostics(self) -> None:
        values = {
            "samples": str(self._fresh),
            "unpaired": str(self._pairer.dropped),
            "held_foot": self._pose.support if self._pose else "",
        }
        if self._reading is not None:
            values |= zmp_messages.reading_values(self._reading)
        state = self._state()
        self._fresh = 0
        stamp = self.get_clock().now().to_msg()
        message = zmp_messages.diagnostics(stamp, self._robot.name, state, values)
        self._diagnostics.publish(message)

    def _state(self) -> tuple[bytes, str]:
        if not self._fresh:
            return DiagnosticStatus.STALE, "no joint states and wrenches of the same stamp"
        if self._reading is None:
            return DiagnosticStatus.WARN, "the feet bear too little for a ZMP"
        margin = self._reading.margin
        if margin < 0.0:
            return DiagnosticStatus.ERROR, "ZMP outside the support polygon"
        if margin < self._warn_margin:
            return DiagnosticStatus.WARN, f"ZMP {margin * 1e3:.1f} mm from the edge"
        return DiagnosticStatus.OK, "ZMP inside the support polygon"


def _period_ns(name: str, rate: float) -> int:
    if rate < 0.0:
        raise SettingError(name, rate, "0 or more")
    return round(1e9 / rate) if rate else 0


def _reliability(text: str) -> ReliabilityPolicy:
    known = {
        "reliable": ReliabilityPolicy.RELIABLE,
        "best_effort": ReliabilityPolicy.BEST_EFFORT,
    }
    if text not in known:
        raise SettingError("reliability", text, " or ".join(known))
    return known[text]


def _heard(publisher: Any) -> bool:
    return bool(publisher.get_subscription_count())


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to end."""
    return run_node(ZmpPublisher, errors=(OSError,), args=args)


if __name__ == "__main__":
    sys.exit(main())

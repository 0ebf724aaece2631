"""Node ``zmp_publisher``: ZMP, CoM, /tf and diagnostics from joints, foot wrenches and the IMU.

The node pairs joint states and foot wrenches of the same stamp, and adds the nearest reading of the
IMU where there is one; the computing is done by `zmp_publisher.odometry` and
`zmp_publisher.zmp_estimator`.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError, SettingError
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import nanoseconds
from geometry_msgs.msg import PointStamped, PolygonStamped, WrenchStamped
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.driver_interface import ImuSample
from humanoid_motion.kinematics import pose_row
from humanoid_motion.robot_model import RobotModel
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from zmp_publisher import messages as zmp_messages
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.soles import RobotPose
from zmp_publisher.stamp_matching import ImuMatcher, StampPairer
from zmp_publisher.zmp_estimator import ZmpEstimator, ZmpReading

PARAMETERS: dict[str, tuple[Any, str]] = {
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "world_frame": ("odom", "frame of all published positions, and parent of base_link in /tf"),
    "robot_start": (
        [0.0, 0.0, 0.0],
        "where the robot stands at first, and after a reset: x [m], y [m] and heading [rad] of the "
        "middle between the soles in the world frame",
    ),
    "threshold": (0.2, "share of the weight below which no /zmp is published"),
    "support_share": (0.05, "share of the weight above which a sole counts as support"),
    "hysteresis": (0.05, "the other sole takes over above the share 0.5 + hysteresis of the load"),
    "warn_margin": (0.01, "margin below which diagnostics warn [m]"),
    "tf_rate": (50.0, "rate of transforms, CoM and support polygon [Hz]; 0 publishes none"),
    "diagnostics_rate": (10.0, "rate of diagnostics [Hz]"),
    "reliability": ("reliable", "QoS of the four subscriptions: reliable or best_effort"),
}
_RELIABILITY = {
    "reliable": ReliabilityPolicy.RELIABLE,
    "best_effort": ReliabilityPolicy.BEST_EFFORT,
}
_JOINTS = "joints"  # name of the stream of joint states; the wrenches' streams are named by side
_QUEUE = 50  # messages of each subscription that may wait for the others
_IMU_PATIENCE = 50_000_000  # a reading counts for samples at most this far from it [ns]
_EARLY = 500_000  # a sample counts as due when it comes at most this much too early [ns]


class ZmpPublisher(GuardedNode):
    """Subscribes to joint states, foot wrenches and IMU, and publishes what follows from them."""

    def __init__(self) -> None:
        super().__init__("zmp_publisher")
        parameters = Parameters(self, PARAMETERS)
        self._world = parameters.text("world_frame")
        self._warn_margin = parameters.number("warn_margin")
        tf_rate = parameters.number("tf_rate", low=0.0)
        self._tf_period = round(1e9 / tf_rate) if tf_rate else 0  # [ns], 0 publishes none
        diagnostics_rate = parameters.positive("diagnostics_rate")
        reliability = _RELIABILITY[parameters.choice("reliability", _RELIABILITY)]

        self._robot = load_robot_config(parameters.text("robot_config") or None)
        self._model = RobotModel(self._robot)
        weight = self._robot.mass * GRAVITY
        share = parameters.number("support_share")
        self._zmp = ZmpEstimator(
            weight,
            self._robot.soles,
            threshold=parameters.number("threshold"),
            support_share=share,
        )
        self._odometry = FootOdometry(
            self._model,
            loaded_force=share * weight,
            hysteresis=parameters.number("hysteresis"),
            start=parameters.numbers("robot_start", 3),
        )
        self._pairer: StampPairer[Any] = StampPairer((_JOINTS, *SIDES), capacity=_QUEUE)
        self._matcher: ImuMatcher[Any, ImuSample] = ImuMatcher(_IMU_PATIENCE)
        self._stamp = -1  # stamp of the last sample [ns]
        self._tf_stamp = -1  # stamp of the last transforms [ns], negative before the first
        self._fresh = 0  # samples since the last diagnostics
        self._reading: ZmpReading | None = None
        self._pose: RobotPose | None = None
        self._tf: TFMessage | None = None  # filled anew for each time
        self._names: tuple[str, ...] = ()  # joints of the last message, in its order
        self._columns: list[int] = []  # where the robot's joints are in that order

        self._zmp_publisher = self.create_publisher(PointStamped, "zmp", 10)
        self._tf_publisher = self.create_publisher(TFMessage, "/tf", 100)
        self._com_publisher = self.create_publisher(PointStamped, "com", 10)
        self._polygon_publisher = self.create_publisher(PolygonStamped, "support_polygon", 10)
        self._marker_publisher = self.create_publisher(MarkerArray, "balance_markers", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        qos = QoSProfile(depth=_QUEUE, reliability=reliability)
        self.create_subscription(JointState, "joint_states", partial(self._take, _JOINTS), qos)
        for side in SIDES:
            take = partial(self._take, side)
            self.create_subscription(WrenchStamped, f"{side}_foot/wrench", take, qos)
        self.create_subscription(Imu, "imu", self._take_imu, qos)
        self.create_timer(1.0 / diagnostics_rate, self._publish_diagnostics)

    def _take(self, stream: str, message: Any) -> None:
        stamp = nanoseconds(message.header.stamp)
        together = self._pairer.add(stream, stamp, message)
        if together is not None:
            self._process_all(self._matcher.add_sample(stamp, together))

    def _take_imu(self, message: Any) -> None:
        reading = zmp_messages.imu_sample(message)
        if reading is None:
            self.get_logger().warning(
                "a message on imu was ignored: it must have orientation and angular velocity",
                throttle_duration_sec=5.0,
            )
            return
        stamp = nanoseconds(message.header.stamp)
        self._process_all(self._matcher.add_reading(stamp, reading))

    def _process_all(self, matches: list[tuple[int, Any, ImuSample | None]]) -> None:
        for time, together, imu in matches:
            wrenches = {side: together[side].wrench for side in SIDES}
            self._process(time, together[_JOINTS], wrenches, imu)

    def _process(
        self, time: int, joints: Any, wrenches: dict[str, Any], imu: ImuSample | None
    ) -> None:
        stamp = joints.header.stamp
        if time < self._stamp:
            self.get_logger().info(
                "the stamps jumped backwards: odom's origin is set again", throttle_duration_sec=1.0
            )
            self._odometry.reset()
            self._tf_stamp = -1
        self._stamp = time
        rows = {side: zmp_messages.wrench_row(wrench) for side, wrench in wrenches.items()}
        forces = {side: float(row[2]) for side, row in rows.items()}
        self._reading, self._pose = None, None
        try:
            positions = self._positions(joints)
            self._pose = self._odometry.update(positions, forces, imu, 1e-9 * time)
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
            self._publish_scene(stamp, positions, self._pose)

    def _positions(self, joints: Any) -> list[float]:
        names = tuple(joints.name)
        if names != self._names:
            missing = [name for name in self._robot.joint_names if name not in names]
            if missing:
                raise SettingError("joint_states", f"without {missing[0]}", "with every joint")
            self._columns = [names.index(name) for name in self._robot.joint_names]
            self._names = names
        if len(joints.position) != len(names):
            raise SettingError("joint_states", len(joints.position), f"{len(names)} positions")
        return [joints.position[column] for column in self._columns]

    def _tf_due(self, time: int) -> bool:
        due = self._tf_stamp < 0 or time - self._tf_stamp >= self._tf_period - _EARLY
        return due and self._tf_period > 0

    def _publish_scene(self, stamp: Any, positions: list[float], pose: RobotPose) -> None:
        # 37 transforms are most of this node's work, so messages are made only for subscribers.
        reading = self._reading
        if self._tf_publisher.get_subscription_count():
            rows = [pose_row(pose.base), *self._model.link_transforms(positions)]
            if self._tf is None:
                frames = [(self._world, "base_link"), *self._model.tree]
                self._tf = zmp_messages.transforms(stamp, frames, rows)
            zmp_messages.move(self._tf, stamp, rows)
            self._tf_publisher.publish(self._tf)
        if reading is not None and self._polygon_publisher.get_subscription_count():
            polygon = zmp_messages.polygon(stamp, self._world, reading.polygon)
            self._polygon_publisher.publish(polygon)
        com_in_base = self._model.com(self._model.configuration(np.zeros(3), positions))
        com = pose.base[:3, :3] @ com_in_base + pose.base[:3, 3]
        self._com_publisher.publish(zmp_messages.point(stamp, self._world, com))
        if self._marker_publisher.get_subscription_count():
            places = {"zmp": None if reading is None else reading.point, "com": com}
            self._marker_publisher.publish(zmp_messages.markers(stamp, self._world, places))

    def _publish_diagnostics(self) -> None:
        values = {
            "samples": str(self._fresh),
            "unpaired": str(self._pairer.dropped),
            "held_foot": self._pose.support if self._pose else "",
            "odometry": "soles and imu" if self._odometry.uses_imu else "soles",
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
            return DiagnosticStatus.WARN, "the feet bear too little load for a ZMP"
        margin = self._reading.margin
        if margin < 0.0:
            return DiagnosticStatus.ERROR, "ZMP outside the support polygon"
        if margin < self._warn_margin:
            return DiagnosticStatus.WARN, f"ZMP {margin * 1e3:.1f} mm from the edge"
        return DiagnosticStatus.OK, "ZMP inside the support polygon"


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; return the exit code."""
    return run_node(ZmpPublisher, errors=(OSError,), args=args)


if __name__ == "__main__":
    sys.exit(main())

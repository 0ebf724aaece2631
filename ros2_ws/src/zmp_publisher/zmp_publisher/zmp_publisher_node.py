"""Node ``zmp_publisher``: ZMP, CoM, /tf and diagnostics from joints, foot wrenches and the IMU.

The node hears complete samples as a motion does, also of a robot whose IMU is silent; the computing
is done by `zmp_publisher.odometry` and `zmp_publisher.zmp_estimator`.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import FRAME_PREFIX, Parameters
from door_impact_common.stamps import NANOSECONDS, stamp_of
from door_model.door.config import hinge_of
from door_model.door.geometry import before
from geometry_msgs.msg import PointStamped, PolygonStamped
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.driver_interface import Command
from humanoid_motion.kinematics import pose_row
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import NO_IMU, Measured
from rclpy.qos import QoSProfile, ReliabilityPolicy
from robot_driver.foot_doubts import LIFTED, FootDoubts, lifted
from robot_driver.inputs import Inputs, Motion
from robot_driver.names import CLOCK, IMU, JOINTS, WRENCHES
from robot_driver.sensor_doubts import doubts, stood_still
from robot_driver.topics import WARNING_PERIOD, SensorTopics, crowded
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from zmp_publisher import messages as zmp_messages
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.soles import RobotPose
from zmp_publisher.zmp_estimator import ZmpEstimator, ZmpReading

PARAMETERS: dict[str, tuple[Any, str]] = {
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "world_frame": ("odom", "frame of all published positions, and parent of the root link in /tf"),
    "frame_prefix": FRAME_PREFIX,
    "robot_start": (
        [0.0, 0.0, 0.0],
        "where the robot stands at first, and after a reset: x [m], y [m] and heading [rad] of the "
        "middle between the soles in the world frame; before a door hinged at the left the mirror "
        "image of this",
    ),
    "door": ("", "name or YAML file of the door before the robot, for the side of its hinge; "
             "empty: at the right"),
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
_QUEUE = 50  # messages of each subscription that may wait for the others
_CROWDED = "more than one node publishes on"
_GRAPH_PERIOD = 1.0  # time between two looks at who publishes [s]
_HANGING = 0.25  # share of the weight below which both feet together count as in the air
_EARLY = 5e-4  # a sample counts as due when it comes at most this much too early [s]


class ZmpPublisher(GuardedNode, Motion):
    """Hears complete samples of joints, foot wrenches and IMU, and publishes what follows."""

    def __init__(self) -> None:
        super().__init__("zmp_publisher")
        parameters = Parameters(self, PARAMETERS)
        prefix = parameters.text("frame_prefix")
        self._world = prefix + parameters.text("world_frame")
        self._warn_margin = parameters.number("warn_margin")
        tf_rate = parameters.number("tf_rate", low=0.0)
        self._tf_period = 1.0 / tf_rate if tf_rate else math.nan  # [s], NaN publishes none
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
            start=before(
                hinge_of(parameters.text("door")), parameters.numbers("robot_start", 3)),
        )
        self._feet = FootDoubts(self._model)
        self._last: Measured | None = None
        self._leapt = False  # since that sample
        self._begin()
        self._frames = [(prefix + parent, prefix + child) for parent, child in (
            (parameters.text("world_frame"), self._robot.root_link), *self._model.tree)]
        self._tf: TFMessage | None = None  # filled anew for each time

        self._zmp_publisher = self.create_publisher(PointStamped, "zmp", 10)
        self._tf_publisher = self.create_publisher(TFMessage, "/tf", 100)
        self._com_publisher = self.create_publisher(PointStamped, "com", 10)
        self._polygon_publisher = self.create_publisher(PolygonStamped, "support_polygon", 10)
        self._marker_publisher = self.create_publisher(MarkerArray, "balance_markers", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._inputs = Inputs(self._model, observes=True)
        self._topics = SensorTopics(self, self._model, self._inputs,
                                    qos=QoSProfile(depth=_QUEUE, reliability=reliability))
        self._topics.start()
        self._inputs.motion = self
        self.create_timer(1.0 / diagnostics_rate, self._publish_diagnostics)
        self.create_service(Trigger, "tare_feet", self._on_tare)
        self._crowded: dict[str, list[str]] = {}
        self.create_timer(_GRAPH_PERIOD, self._look_at_graph)

    def _begin(self) -> None:
        """Begin anew: the next sample defines the origin of odom."""
        self._tf_stamp = -math.inf  # stamp of the last transforms [s]
        self._fresh = 0  # samples since the last diagnostics
        self._reading: ZmpReading | None = None
        self._pose: RobotPose | None = None
        self._odometry.reset()
        self._feet.begin()

    @property
    def running(self) -> bool:
        """Return that no motion is under way: odom may begin anew."""
        return False

    def lags(self, seconds: float) -> None:
        """Publish what is late, too."""

    def give_up(self, reason: str) -> None:
        """Judge by the next sample whether odom begins anew: the clock or the stamps went back."""
        self._leapt, self._tf_stamp = True, -math.inf

    def on_failure(self, now: float, error: Exception) -> list[Command]:
        """Leave the sample out."""
        return []

    def on_measured(self, now: float, measured: Measured) -> list[Command]:
        """Publish ZMP, CoM and transforms."""
        if self._leapt and self._last is not None:
            stood = stood_still(self._last, measured, self._robot.mass * GRAVITY)
            self.get_logger().info(
                "the clock went back: " + ("the robot has not moved, and keeps its place in odom"
                                           if stood else "odom's origin is set again"),
                throttle_duration_sec=WARNING_PERIOD)
            if not stood:
                self._begin()
        self._leapt, self._last = False, measured
        wrenches = {"left": measured.left_wrench, "right": measured.right_wrench}
        forces = {side: float(row[2]) for side, row in wrenches.items()}
        imu = None if measured.imu is NO_IMU else measured.imu
        stamp = stamp_of(round(now * NANOSECONDS))
        self._pose = self._odometry.update(measured.position, forces, imu, now)
        self._reading = self._zmp.read(self._pose.soles, wrenches) if self._pose else None
        if self._pose is not None:
            self._feet.add(measured, self._pose.base, self._pose.soles)
        self._fresh += 1
        if self._reading is not None:
            place = self._reading.point
            self._zmp_publisher.publish(zmp_messages.point(stamp, self._world, place))
        if self._pose is not None and now - self._tf_stamp >= self._tf_period - _EARLY:
            self._tf_stamp = now
            self._publish_scene(stamp, measured.position, self._pose)
        return []

    def _on_tare(self, _: Any, response: Any) -> Any:
        """Say what the sensors of feet in the air report, as lines for the parameter file."""
        sides: tuple[str, ...] = ()
        if self._last is not None and self._pose is not None:
            load = self._last.left_wrench[2] + self._last.right_wrench[2]
            air = lifted(self._pose.soles)
            hangs = abs(load) < _HANGING * self._robot.mass * GRAVITY
            sides = SIDES if hangs else (air,) if air else ()
        found = {side: self._topics.feet.offset(side) for side in sides}
        wrong = [f"{side} foot: {each}" for side, each in found.items() if isinstance(each, str)]
        response.success = bool(sides) and not wrong
        response.message = "; ".join(wrong) or "\n".join(
            f"{side}_foot_offset: {[round(float(value), 3) for value in each]}"
            for side, each in found.items()) or (
            "no foot is in the air: let the robot hang, so that its feet bear less than "
            f"{100.0 * _HANGING:g} % of its weight, or lift a foot by {1e3 * LIFTED:g} mm")
        return response

    def _look_at_graph(self) -> None:
        before = self._crowded
        self._crowded = crowded(self, (CLOCK, JOINTS, IMU, *WRENCHES.values()))
        for topic, names in self._crowded.items():
            if before.get(topic) != names:
                self.get_logger().warning(f"{_CROWDED} {topic}: {', '.join(names)}")

    def _publish_scene(self, stamp: Any, positions: Array, pose: RobotPose) -> None:
        # 37 transforms are most of this node's work, so messages are made only for subscribers.
        reading = self._reading
        if self._tf_publisher.get_subscription_count():
            rows = [pose_row(pose.base), *self._model.link_transforms(positions)]
            if self._tf is None:
                self._tf = zmp_messages.transforms(stamp, self._frames, rows)
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
        doubted = [f"{each.topic}: {each.text}" for each in (
            *doubts(self._model, self._inputs.recent), *self._feet.found)] if self._fresh else []
        if self._odometry.doubt:
            doubted.append(f"{IMU}: {self._odometry.doubt}")
        doubted += [f"{_CROWDED} {topic}: {', '.join(names)}"
                    for topic, names in self._crowded.items()]
        values = {
            "samples": str(self._fresh),
            "unpaired": str(self._inputs.unpaired),
            "held_foot": self._pose.support if self._pose else "",
            "odometry": "soles and imu" if self._odometry.uses_imu else "soles",
            **self._inputs.intake.noticed(),
            **{f"doubt {number}": text for number, text in enumerate(doubted, 1)},
        }
        if self._reading is not None:
            values |= zmp_messages.reading_values(self._reading)
        level, text = self._state()
        if doubted:
            level, text = max(level, DiagnosticStatus.WARN), "; ".join([text, *doubted])
        self._fresh = 0
        stamp = self.get_clock().now().to_msg()
        message = zmp_messages.diagnostics(stamp, self._robot.name, (level, text), values)
        self._diagnostics.publish(message)

    def _state(self) -> tuple[bytes, str]:
        if not self._fresh:
            why = "".join(f"; {topic}{cause}" for topic in (JOINTS, *WRENCHES.values())
                          if (cause := self._topics.cause(topic)))
            return (DiagnosticStatus.STALE,
                    f"no joint states and wrenches of the same stamp{why}")
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

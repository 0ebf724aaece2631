"""Node ``zmp_publisher``: ZMP, CoM, /tf and diagnostics from joints, foot wrenches and the IMU.

The node pairs joint states and foot wrenches of the same stamp, and adds the nearest reading of the
IMU where there is one; the computing is done by `zmp_publisher.odometry` and
`zmp_publisher.zmp_estimator`.
"""

from __future__ import annotations

import sys
from collections import deque
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import nanoseconds, seconds
from door_model.door.config import hinge_of
from door_model.door.geometry import before
from geometry_msgs.msg import PointStamped, PolygonStamped, WrenchStamped
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.kinematics import pose_row
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample, Measured
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration
from rclpy.qos import QoSProfile, ReliabilityPolicy
from robot_driver.inputs import RECENT
from robot_driver.intake import Arrival, Intake
from robot_driver.messages import imu_sample, wrench_row
from robot_driver.names import IMU, JOINTS, WRENCHES
from robot_driver.ranges import FORCE, INERTIAL, joint_ranges
from robot_driver.sensor_doubts import doubts
from robot_driver.topics import crowded, silence_of
from sensor_msgs.msg import Imu, JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from zmp_publisher import messages as zmp_messages
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.soles import OTHER, RobotPose
from zmp_publisher.stamp_matching import ImuMatcher, StampPairer
from zmp_publisher.zmp_estimator import ZmpEstimator, ZmpReading

PARAMETERS: dict[str, tuple[Any, str]] = {
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "world_frame": ("odom", "frame of all published positions, and parent of base_link in /tf"),
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
_NO_IMU = ImuSample(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3))
_QUEUE = 50  # messages of each subscription that may wait for the others
_IMU_PATIENCE = 50_000_000  # a reading counts for samples at most this far from it [ns]
_IN_AIR = 0.015  # height above the other sole at which a sole bears no robot [m]
_GRAPH_PERIOD = 1.0  # time between two looks at who publishes [s]
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
            start=before(
                hinge_of(parameters.text("door")), parameters.numbers("robot_start", 3)),
        )
        self._intake = Intake({
            JOINTS: joint_ranges(self._model), IMU: INERTIAL,
            **dict.fromkeys(WRENCHES.values(), FORCE)})
        self._begin()
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
        self.create_subscription(JointState, "joint_states", self._take_joints, qos)
        for side in SIDES:
            take = partial(self._take_wrench, side)
            self.create_subscription(WrenchStamped, f"{side}_foot/wrench", take, qos)
        self.create_subscription(Imu, "imu", self._take_imu, qos)
        self.create_timer(1.0 / diagnostics_rate, self._publish_diagnostics)
        self._crowded: dict[str, list[str]] = {}
        self.create_timer(_GRAPH_PERIOD, self._look_at_graph)
        self._jumps = self.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1),
                          on_clock_change=False),
            post_callback=self._clock_went_back)

    def _begin(self) -> None:
        """Begin anew: the next sample defines the origin of odom."""
        self._pairer: StampPairer[Any] = StampPairer((JOINTS, *SIDES), capacity=_QUEUE)
        self._matcher: ImuMatcher[Any, ImuSample] = ImuMatcher(_IMU_PATIENCE)
        self._recent: deque[Measured] = deque(maxlen=RECENT)
        self._tf_stamp = -1  # stamp of the last transforms [ns], negative before the first
        self._fresh = 0  # samples since the last diagnostics
        self._reading: ZmpReading | None = None
        self._pose: RobotPose | None = None
        self._odometry.reset()

    def _clock_went_back(self, _: Any) -> None:
        self._intake.forget()
        self._begin()

    def _accepted(self, topic: str, message: Any, values: Any) -> bool:
        """Check a message; stamps that go back by more than a second belong to a new clock."""
        clocks, stamp = self._intake.clocks, seconds(message.header.stamp)
        now = max(stamp, self.get_clock().now().nanoseconds * 1e-9)
        accepted = self._intake.accept(topic, Arrival(stamp, now, 0.0), values)
        if self._intake.clocks > clocks:
            self.get_logger().warning(f"the stamps of {topic} went back to {stamp:.3f} s: a new "
                                      "clock; odom's origin is set again")
            self._begin()
        return accepted

    def _take_joints(self, message: JointState) -> None:
        try:
            positions, velocities = self._joints(message)
        except SettingError as error:
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return
        known = np.nan_to_num(velocities)
        if self._accepted(JOINTS, message, np.concatenate([positions, known])):
            self._take(JOINTS, message, (positions, velocities, message.header.stamp))

    def _take_wrench(self, side: str, message: WrenchStamped) -> None:
        row = wrench_row(message.wrench)
        if self._accepted(WRENCHES[side], message, row):
            self._take(side, message, row)

    def _take(self, stream: str, message: Any, content: Any) -> None:
        stamp = nanoseconds(message.header.stamp)
        together = self._pairer.add(stream, stamp, content)
        if together is not None:
            self._process_all(self._matcher.add_sample(stamp, together))

    def _take_imu(self, message: Imu) -> None:
        reading = imu_sample(message)
        if reading is None:
            self.get_logger().warning(
                "a message on imu was ignored: it must have orientation and angular velocity",
                throttle_duration_sec=5.0,
            )
            return
        values = (reading.tilt, *reading.angular_velocity, *reading.specific_force)
        if self._accepted(IMU, message, values):
            stamp = nanoseconds(message.header.stamp)
            self._process_all(self._matcher.add_reading(stamp, reading))

    def _process_all(self, matches: list[tuple[int, Any, ImuSample | None]]) -> None:
        for time, together, imu in matches:
            wrenches = {side: together[side] for side in SIDES}
            self._process(time, together[JOINTS], wrenches, imu)

    def _process(
        self, time: int, joints: Any, wrenches: dict[str, Array], imu: ImuSample | None
    ) -> None:
        positions, velocities, stamp = joints
        forces = {side: float(row[2]) for side, row in wrenches.items()}
        self._recent.append(Measured(positions, velocities, imu or _NO_IMU, wrenches["left"],
                                     wrenches["right"], 1e-9 * time))
        self._pose = self._odometry.update(positions, forces, imu, 1e-9 * time)
        self._reading = self._zmp.read(self._pose.soles, wrenches) if self._pose else None
        self._fresh += 1
        if self._reading is not None:
            place = self._reading.point
            self._zmp_publisher.publish(zmp_messages.point(stamp, self._world, place))
        if self._pose is not None and self._tf_due(time):
            self._tf_stamp = time
            self._publish_scene(stamp, positions, self._pose)

    def _joints(self, joints: JointState) -> tuple[Array, Array]:
        """Read positions [rad] and speeds [rad/s], (J,) each; speeds may be missing, then NaN.

        Raises:
            SettingError: A joint or a position is missing, or not finite.
        """
        names = tuple(joints.name)
        if names != self._names:
            missing = [name for name in self._robot.joint_names if name not in names]
            if missing:
                raise SettingError("joint_states", f"without {missing[0]}", "with every joint")
            self._columns = [names.index(name) for name in self._robot.joint_names]
            self._names = names
        if len(joints.position) != len(names):
            raise SettingError("joint_states", len(joints.position), f"{len(names)} positions")
        positions = np.array(joints.position)[self._columns]
        if not np.isfinite(positions).all():
            bad = int(np.argmin(np.isfinite(positions)))
            raise SettingError(self._robot.joint_names[bad], float(positions[bad]), "finite")
        known = len(joints.velocity) == len(names)
        return positions, (np.array(joints.velocity)[self._columns] if known
                           else np.full(len(positions), np.nan))

    def _look_at_graph(self) -> None:
        self._crowded = crowded(self, (JOINTS, IMU, *WRENCHES.values()))

    def _tf_due(self, time: int) -> bool:
        due = self._tf_stamp < 0 or time - self._tf_stamp >= self._tf_period - _EARLY
        return due and self._tf_period > 0

    def _publish_scene(self, stamp: Any, positions: Array, pose: RobotPose) -> None:
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
        doubted = [f"{each.topic}: {each.text}"
                   for each in doubts(self._model, self._recent)] if self._fresh else []
        if self._odometry.doubt:
            doubted.append(f"{IMU}: {self._odometry.doubt}")
        if exchanged := self._exchanged():
            doubted.append(exchanged)
        doubted += [f"more than one node publishes on {topic}: {', '.join(names)}"
                    for topic, names in self._crowded.items()]
        values = {
            "samples": str(self._fresh),
            "unpaired": str(self._pairer.dropped),
            "held_foot": self._pose.support if self._pose else "",
            "odometry": "soles and imu" if self._odometry.uses_imu else "soles",
            **self._intake.noticed(),
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

    def _exchanged(self) -> str:
        """Doubt about a sole that bears the robot although it is in the air; empty without one."""
        if self._pose is None or self._reading is None or len(self._reading.loaded) != 1:
            return ""
        (side,) = self._reading.loaded
        height = {each: float(pose[2, 3]) for each, pose in self._pose.soles.items()}
        above = height[side] - height[OTHER[side]]
        if above <= _IN_AIR:
            return ""
        return (f"{WRENCHES[side]}: this sole bears the robot, but by the joints it is "
                f"{1e3 * above:.0f} mm above the other one, at most {1e3 * _IN_AIR:g} mm are "
                "expected: are the feet's wrenches exchanged?")

    def _state(self) -> tuple[bytes, str]:
        if not self._fresh:
            causes = (silence_of(self, topic) for topic in (JOINTS, *WRENCHES.values()))
            why = next((cause for cause in causes if cause), "") or "".join(
                f"; {topic}: {why}" for topic, why in self._intake.last_dropped.items())
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

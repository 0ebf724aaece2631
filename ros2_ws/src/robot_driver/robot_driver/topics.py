"""Subscriptions to the topics about robot and door, and the watch over them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from door_impact_common.arrays import Array
from door_impact_common.node import GuardedNode
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import seconds, stamp_of
from geometry_msgs.msg import PointStamped, WrenchStamped
from humanoid_motion.driver_interface import Command
from humanoid_motion.mirror import Straight
from humanoid_motion.robot_model import RobotModel
from rclpy.clock import Clock, ClockType, JumpThreshold
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Header

from robot_driver.foot_sensors import FootSensors
from robot_driver.freshness import Freshness
from robot_driver.inputs import Inputs
from robot_driver.intake import Arrival, present
from robot_driver.messages import (
    diagnostics,
    imu_sample,
    joint_arrays,
    lacking,
    wrench_of,
    wrench_row,
)
from robot_driver.names import (
    CLOCK,
    COMMANDERS,
    DOOR,
    HAND,
    HANDLED,
    IMU,
    JOINTS,
    PAUSED,
    TRAJECTORY,
    WRENCHES,
)
from robot_driver.sensor_doubts import doubts, grave

WATCH_PERIOD = 0.05  # time between two checks that messages arrive [s]
DIAGNOSTICS_PERIOD = 1.0  # time between two messages on /diagnostics [s]
_QUEUE = 50  # messages of each subscription that may wait
WARNING_PERIOD = 5.0  # shortest time between two warnings about unusable messages [s]
OFFSETS = {
    f"{side}_foot_offset": ([0.0] * 6, f"what the force sensor of the {side} foot reports without "
                            "load: force [N] and torque [N m] in its frame (tare_feet tells it)")
    for side in WRENCHES}
SILENCE = {
    "stale_after": (0.5, "largest age of messages about robot and door [s]"),
    "silent_after": (5.0, "time without a message about robot or door, by the computer's clock, "
                     "after which a motion ends although the clock of a simulation stands [s]"),
}


class SensorTopics:
    """Passes what the robot's driver measures to `Inputs`, between `start` and `stop`.

    Args:
        node: Node that subscribes; it gets the parameters `OFFSETS`.
        robot: The robot.
        inputs: Gets the measurements.
        after: Function that gets the stamp of an event [s] and the commands that follow from it.
        sight: How robot and door are seen; topics have the names that they have in it.
        qos: Depth of the subscriptions' queues, or their QoS.

    Attributes:
        inputs: The measurements.
        feet: The feet's force sensors.
        waited_for: Whether a simulation waits until this node has handled its messages.
    """

    waited_for = False

    def __init__(
        self, node: GuardedNode, robot: RobotModel, inputs: Inputs,
        after: Callable[[float, Sequence[Command]], None] = lambda stamp, commands: None, *,
        sight: Straight | None = None, qos: QoSProfile | int = _QUEUE,
    ) -> None:
        self._sight = sight or Straight()
        self._node, self._after, self._qos = node, after, qos
        self._names = list(robot.joint_names)
        given = Parameters(node, OFFSETS)
        self.feet = FootSensors(robot, {self._sight.text(side): wrench_row(self._sight.message(
            wrench_of(given.numbers(f"{side}_foot_offset", 6)))) for side in WRENCHES})
        self._ignored: dict[str, str] = {}  # why the last message of a topic could not be used
        self.inputs = inputs
        self._handlers: dict[str, tuple[Any, Callable[[Any, Arrival], Sequence[Command]]]] = {
            JOINTS: (JointState, self._on_joints), IMU: (Imu, self._on_imu),
            **{topic: (WrenchStamped, partial(self._on_wrench, side))
               for side, topic in WRENCHES.items()}}
        self._subscriptions: list[Any] = []
        self._newest = -math.inf  # present time when the last message came [s]
        self._jumps = node.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1),
                          on_clock_change=False),
            post_callback=self._clock_went_back)

    def start(self) -> None:
        """Subscribe, and forget what was received before."""
        self._newest = -math.inf
        self.inputs.forget()
        self.inputs.intake.begin()
        self._ignored.clear()
        self._subscriptions = [
            self._subscribe(topic, *handler) for topic, handler in self._handlers.items()]

    def stop(self) -> None:
        """Unsubscribe: a thousand messages a second would be read for nothing."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions = []

    def now(self) -> float:
        """Present time of the robot's clock [s]: a simulation's /clock is rarer than messages."""
        return present(self._clock(), self._newest)

    def cause(self, topic: str) -> str:
        """Say why messages of a topic may be missing; empty if nothing is known."""
        if topic in self._ignored:
            return f": the last one was ignored, {self._ignored[topic]}"
        if topic in self.inputs.intake.last_dropped:
            return f": the last one was dropped, {self.inputs.intake.last_dropped[topic]}"
        return silence_of(self._node, self._sight.text(topic))

    # -- messages -------------------------------------------------------------------------------

    def _subscribe(
        self, topic: str, kind: Any, handle: Callable[[Any, Arrival], Sequence[Command]]
    ) -> Any:
        def callback(message: Any, info: dict[str, Any]) -> None:
            stamp, sent = seconds(message.header.stamp), info["source_timestamp"]
            # A simulation that waits for this node is not ahead of what its clock says.
            underway = 0.0 if self.waited_for or not sent else 1e-9 * (time.time_ns() - sent)
            self._newest = present(self._clock(), self._newest, stamp)
            with self._ends_the_motion():
                self._after(stamp, handle(
                    self._sight.message(message), Arrival(stamp, self._newest, underway)))

        return self._node.create_subscription(kind, self._sight.text(topic), callback, self._qos)

    def _on_joints(self, message: JointState, arrival: Arrival) -> Sequence[Command]:
        state = joint_arrays(message, self._names)
        if state is None:
            return self._ignore(JOINTS, "it must have the position and the speed of every joint, "
                                f"as finite numbers; {lacking(message, self._names)}")
        return self.inputs.on_joints(arrival, *state)

    def _on_imu(self, message: Imu, arrival: Arrival) -> Sequence[Command]:
        reading = imu_sample(message)
        if reading is None:
            turn = message.orientation
            length = math.hypot(turn.x, turn.y, turn.z, turn.w)
            return self._ignore(IMU, "it must have an orientation and an angular velocity, and the "
                                f"length of its quaternion is {length:g}, must be 1")
        return self.inputs.on_imu(arrival, reading)

    def _on_wrench(self, side: str, message: WrenchStamped, arrival: Arrival) -> Sequence[Command]:
        row = self.feet.at_sole(side, message.header.frame_id, wrench_row(message.wrench))
        if isinstance(row, str):
            return self._ignore(WRENCHES[side], row)
        return self.inputs.on_wrench(side, arrival, row)

    def _ignore(self, topic: str, why: str) -> Sequence[Command]:
        self._ignored[topic] = why
        self._node.get_logger().warning(f"a message on {topic} was ignored: {why}",
                                        throttle_duration_sec=WARNING_PERIOD)
        return ()

    @contextmanager
    def _ends_the_motion(self) -> Iterator[None]:
        """End the motion where an error of the program is raised; the node's guard logs it."""
        try:
            yield
        except Exception as error:  # a motion must not go on without its node
            self._after(-math.inf, self.inputs.on_failure(error))
            raise

    def _clock(self) -> float:
        return float(self._node.get_clock().now().nanoseconds * 1e-9)

    def _clock_went_back(self, _: Any) -> None:
        """Give up the motion: after a reset of the simulation its times mean nothing any more."""
        self._newest = self._told = -math.inf
        self.inputs.forget()
        self._after(-math.inf, [])


class RobotTopics(SensorTopics):
    """Passes the messages about robot and door to a motion, and watches over them.

    A motion ends where its topics fall silent, by the robot's clock or by the computer's steady
    clock, because a simulation that dies takes the robot's clock with it; one that says that it is
    paused is not silent. It ends, too, where the program fails or the robot's clock goes back.

    Args:
        node: Node that subscribes.
        robot: The robot.
        parameters: Parameters of the node with the names in `SILENCE`.
        after: Function that gets the stamp of an event [s] and the commands that follow from it.
        further: Type, name and handler of topics that are only passed on, as they are.
        sight: How robot and door are seen; topics have the names that they have in it.

    Attributes:
        freshness: Age of the last messages by the robot's clock.
        zmp: Stamp [s] and place in odom, (2,) [m], of the last ZMP; None before the first one.
        awake: Time by the computer's steady clock, without pauses of a simulation [s].
    """

    def __init__(
        self, node: GuardedNode, robot: RobotModel, parameters: Parameters,
        after: Callable[[float, Sequence[Command]], None], *,
        further: Sequence[tuple[Any, str, Callable[[Any], None]]] = (),
        sight: Straight | None = None,
    ) -> None:
        self._robot = robot
        self.freshness, self._silence = (
            Freshness((JOINTS, IMU, DOOR, HAND), parameters.number(name), WATCH_PERIOD,
                      optional=[HAND]) for name in ("stale_after", "silent_after"))
        super().__init__(
            node, robot, Inputs(robot, self.freshness, self._silence),
            self._sent, sight=sight)
        self._send = after
        self.zmp: tuple[float, Array] | None = None
        self._handlers[DOOR] = (JointState, self._on_door)
        self._handlers[HAND] = (WrenchStamped, self._on_hand)
        self._further = [(PointStamped, "zmp", self._on_zmp), *further]
        self._handled = node.create_publisher(Header, HANDLED, _QUEUE)
        self._told = -math.inf  # stamp that was told there last [s]
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.awake, self._paused = 0.0, False
        node.create_subscription(Bool, PAUSED, self._on_paused, QoSProfile(
            depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(WATCH_PERIOD, partial(self._watch, self.freshness))
        node.create_timer(WATCH_PERIOD, self._tick, clock=steady)
        node.create_timer(DIAGNOSTICS_PERIOD, self._report, clock=steady)

    def start(self) -> None:
        """Subscribe, and forget what was received before."""
        super().start()
        self._subscriptions += [
            self._node.create_subscription(*topic, _QUEUE) for topic in self._further]

    def stop(self) -> None:
        """Unsubscribe, and let a simulation go on by itself."""
        super().stop()
        self._told = -math.inf
        self._handled.publish(Header())

    def _sent(self, stamp: float, commands: Sequence[Command]) -> None:
        """Send what follows from an event; then tell a simulation how far this node has come."""
        self._send(stamp, commands)
        handled = self.freshness.handled()
        if handled > self._told:
            self._told = handled
            self.waited_for = self._handled.get_subscription_count() > 0
            self._handled.publish(Header(stamp=stamp_of(round(1e9 * handled))))

    def refusal(self, topics: Sequence[str]) -> tuple[str, float] | None:
        """Find why no motion can begin: missing or old messages, or sensors that contradict.

        What is only doubtful is logged.

        Args:
            topics: Topics that the motion needs.

        Returns:
            A sentence with topic, value and limit, and the value; None if a motion can begin.
        """
        log = self._node.get_logger()
        for topic, names in self.crowded().items():
            log.warning(f"more than one node publishes on {topic}: {', '.join(names)}; one of them "
                        "may be foreign")
        stale = self.freshness.refusal(self.now(), topics)
        if stale is not None:
            topic, text, value = stale
            return text + self.cause(topic), value
        found = doubts(self._robot, self.inputs.recent)
        for doubt in found:
            log.warning(f"{doubt.topic}: {doubt.text}")
        return grave(found)

    def _on_door(self, message: JointState, arrival: Arrival) -> Sequence[Command]:
        if not (message.position and message.velocity):
            return self._ignore(DOOR, "it must have the door's angle and angular velocity")
        return self.inputs.on_door(arrival, message.position[0], message.velocity[0])

    def _on_hand(self, message: WrenchStamped, arrival: Arrival) -> Sequence[Command]:
        return self.inputs.on_hand(arrival, wrench_row(message.wrench))

    def _on_zmp(self, message: PointStamped) -> None:
        place = self._sight.message(message).point
        self.zmp = (seconds(message.header.stamp), np.array([place.x, place.y]))

    def _on_paused(self, message: Bool) -> None:
        self._paused = message.data

    def _tick(self) -> None:
        """Count the computer's time, but for the pauses of a simulation that runs."""
        if not (self._paused and self._node.count_publishers(PAUSED)):
            self.awake += WATCH_PERIOD
            self._watch(self._silence)

    def _watch(self, watch: Freshness) -> None:
        """End a motion if messages about robot or door do not arrive any more."""
        missing, joints = watch.tick(), self.inputs.joints
        if missing is None or joints is None:
            return
        with self._ends_the_motion():
            self._after(joints[0], self.inputs.on_silence(*missing, watch.limit))

    def _report(self) -> None:
        """Publish what was dropped or late, and who publishes beside the driver."""
        self._diagnostics.publish(diagnostics(
            self._node.get_fully_qualified_name()[1:], self.inputs.intake, self.crowded(),
            self._node.get_clock().now().to_msg()))

    def crowded(self) -> dict[str, list[str]]:
        """Names of a topic's publishers, for each topic that has one too many."""
        return crowded(self._node, (CLOCK, *map(self._sight.text, self._handlers), TRAJECTORY))


def silence_of(node: GuardedNode, topic: str) -> str:
    """Say why a reliable subscription to a topic may get nothing."""
    publishers = node.get_publishers_info_by_topic(topic)
    if not publishers:
        return ": nobody publishes there; does the driver run?"
    for one in publishers:
        if one.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT:
            return (f": {one.node_name} publishes with the QoS best effort, which a subscription "
                    "with the QoS reliable does not get; let it publish reliably")
    return ""


def crowded(node: GuardedNode, topics: Iterable[str]) -> dict[str, list[str]]:
    """Return the names of a topic's publishers, for each topic that has one too many.

    The clock and a topic of the driver have one publisher, and only the `COMMANDERS` in the node's
    own namespace send trajectories.
    """
    found, own = {}, node.get_namespace().rstrip("/")
    commanders = {f"{own}/{name}" for name in COMMANDERS}
    for topic in topics:
        names = sorted(f"{one.node_namespace.rstrip('/')}/{one.node_name}"
                       for one in node.get_publishers_info_by_topic(topic))
        allowed = commanders if topic == TRAJECTORY else ()
        foreign = [name for name in names if name not in allowed]
        twice = len(names) - len(foreign) > len(set(names) - set(foreign))
        if twice or len(foreign) > (topic != TRAJECTORY):
            found[topic] = names
    return found

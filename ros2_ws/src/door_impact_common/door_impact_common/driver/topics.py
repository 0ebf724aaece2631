"""Subscriptions to the driver's topics, and the watch over them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, Protocol

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType, JumpThreshold
from rclpy.duration import Duration

from door_impact_common.arrays import Array
from door_impact_common.driver.freshness import Freshness
from door_impact_common.driver.intake import Arrival, Intake, present
from door_impact_common.driver.messages import diagnostics
from door_impact_common.driver.names import COMMANDERS, TRAJECTORY
from door_impact_common.node import GuardedNode
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import seconds

WATCH_PERIOD = 0.05  # time between two checks that messages arrive [s]
DIAGNOSTICS_PERIOD = 1.0  # time between two messages on /diagnostics [s]
WARNING_PERIOD = 5.0  # shortest time between two warnings about unusable messages [s]
SILENCE = {
    "stale_after": (0.5, "largest age of messages about robot and door [s]"),
    "silent_after": (5.0, "time without a message about robot or door, by the computer's clock, "
                     "after which a motion ends although the clock of a simulation stands [s]"),
}


class MotionInputs(Protocol):
    """What passes the driver's messages to a motion; each handler returns commands.

    Attributes:
        intake: The checks of the messages.
    """

    intake: Intake

    @property
    def joints(self) -> tuple[float, Array, Array] | None:
        """Stamp [s], positions [rad] and speeds [rad/s] of the last joint state, if any."""

    def forget(self) -> None:
        """Forget all messages and give up the motion: the robot's clock went back."""

    def on_failure(self, error: Exception) -> Sequence[Any]:
        """Handle an error of the program."""

    def on_silence(self, topic: str, waited: float, limit: float) -> Sequence[Any]:
        """Handle a topic without a message for a time [s] that exceeds its limit [s]."""


class Watches:
    """The watches for silent topics: by the robot's clock, and by the computer's steady clock.

    Args:
        topics: Topics that must not fall silent.
        parameters: Parameters of the node with the names in `SILENCE`.

    Attributes:
        freshness: Age of the last messages by the robot's clock.
        silence: Time without messages by the computer's clock, because a simulation that dies
            takes the robot's clock with it.
    """

    def __init__(self, topics: Sequence[str], parameters: Parameters) -> None:
        self.freshness = Freshness(topics, parameters.number("stale_after"), WATCH_PERIOD)
        self.silence = Freshness(topics, parameters.number("silent_after"), WATCH_PERIOD)


class WatchedTopics:
    """Subscribes to the driver's topics, and ends the motion where they fall silent or fail.

    Args:
        node: Node that subscribes.
        inputs: Passes the messages to the motion.
        watches: Watches for silent topics, in each of which `inputs` notes what it accepts.
        after: Function that gets the stamp of an event [s] and the commands that follow from it.
    """

    def __init__(
        self, node: GuardedNode, inputs: MotionInputs, watches: Watches,
        after: Callable[[float, Sequence[Any]], None],
    ) -> None:
        self._node, self._inputs, self._after = node, inputs, after
        self._topics: list[str] = []
        self._newest = -math.inf  # present time when the last message came [s]
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(WATCH_PERIOD, partial(self._watch, watches.freshness))
        node.create_timer(WATCH_PERIOD, partial(self._watch, watches.silence), clock=steady)
        node.create_timer(DIAGNOSTICS_PERIOD, self._report, clock=steady)
        self._jumps = node.get_clock().create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1),
                          on_clock_change=False),
            post_callback=self._clock_went_back)

    def subscribe(
        self, kind: Any, topic: str, handle: Callable[[Any, Arrival], Sequence[Any]]
    ) -> Any:
        """Subscribe to a topic about robot or door; return the subscription.

        Args:
            kind: Type of its messages, which have a header.
            topic: Its name.
            handle: Function that gets the message and its times, and returns commands.
        """
        def callback(message: Any, info: dict[str, Any]) -> None:
            stamp, sent = seconds(message.header.stamp), info["source_timestamp"]
            underway = 1e-9 * (time.time_ns() - sent) if sent else 0.0
            self._newest = present(self._clock(), self._newest, stamp)
            with self._ends_the_motion():
                self._after(stamp, handle(message, Arrival(stamp, self.now(), underway)))

        if topic not in self._topics:
            self._topics.append(topic)
        return self._node.create_subscription(kind, topic, callback, 50)

    @contextmanager
    def _ends_the_motion(self) -> Iterator[None]:
        """End the motion where an error of the program is raised; the node's guard logs it."""
        try:
            yield
        except Exception as error:  # a motion must not go on without its node
            self._after(-math.inf, self._inputs.on_failure(error))
            raise

    def now(self) -> float:
        """Present time of the robot's clock [s]: a simulation's /clock is rarer than messages."""
        return present(self._clock(), self._newest)

    def _clock(self) -> float:
        return float(self._node.get_clock().now().nanoseconds * 1e-9)

    def ignored(self, topic: str, why: str) -> list[Any]:
        """Warn that a message was ignored; return the commands that follow, which are none."""
        self._node.get_logger().warning(f"a message on {topic} was ignored: {why}",
                                        throttle_duration_sec=WARNING_PERIOD)
        return []

    def _clock_went_back(self, _: Any) -> None:
        """Give up the motion: after a reset of the simulation its times mean nothing any more."""
        self._newest = -math.inf
        self._inputs.forget()
        self._after(-math.inf, [])

    def _watch(self, watch: Freshness) -> None:
        """End a motion if messages about robot or door do not arrive any more."""
        missing, joints = watch.tick(), self._inputs.joints
        if missing is None or joints is None:
            return
        with self._ends_the_motion():
            self._after(joints[0], self._inputs.on_silence(*missing, watch.limit))

    def _report(self) -> None:
        """Publish what was dropped or late, and who publishes beside the driver."""
        self._diagnostics.publish(diagnostics(
            self._node.get_name(), self._inputs.intake, self.crowded(),
            self._node.get_clock().now().to_msg()))

    def crowded(self) -> dict[str, list[str]]:
        """Names of a topic's publishers, for each topic that has one too many.

        A topic of the driver has one publisher, and only the `COMMANDERS` send trajectories.
        """
        found = {}
        for topic in (*self._topics, TRAJECTORY):
            names = sorted(f"{one.node_namespace.rstrip('/')}/{one.node_name}"
                           for one in self._node.get_publishers_info_by_topic(topic))
            allowed = COMMANDERS if topic == TRAJECTORY else ()
            foreign = [name for name in names if name.rpartition("/")[2] not in allowed]
            twice = len(names) - len(foreign) > len(set(names) - set(foreign))
            if twice or len(foreign) > (topic != TRAJECTORY):
                found[topic] = names
        return found

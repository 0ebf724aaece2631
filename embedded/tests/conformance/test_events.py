"""Events of publishers and subscriptions: what does not fit, matches, deadlines, liveliness."""

import warnings
from typing import Any

import pytest
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)
from spinning import make, spin_until
from std_msgs.msg import String

LATCHED = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


def test_what_does_not_fit_is_warned_of(
    executor: SingleThreadedExecutor, capfd: pytest.CaptureFixture[str]
) -> None:
    """Both sides warn, by the name that the program gave, and no message comes."""
    node = make(executor)
    got: list[Any] = []
    node.create_subscription(String, "x", got.append, 1)
    publisher = node.create_publisher(String, "x", BEST_EFFORT)
    text = ""

    def warned() -> bool:
        nonlocal text
        text += capfd.readouterr().err
        return text.count("RELIABILITY") == 2

    assert spin_until(executor, warned)
    assert (
        "[tester]: New publisher discovered on topic 'x', offering incompatible QoS. "
        "No messages will be received from it. Last incompatible policy: RELIABILITY\n"
    ) in text
    assert (
        "[tester]: New subscription discovered on topic 'x', requesting incompatible QoS. "
        "No messages will be sent to it. Last incompatible policy: RELIABILITY\n"
    ) in text
    assert text.count("[WARN]") == 2
    publisher.publish(String())
    for _ in range(5):
        executor.spin_once(timeout_sec=0.02)
    assert got == []
    assert publisher.get_subscription_count() == 0
    assert node.count_subscribers("x") == 1


def test_callbacks_instead_of_warnings(
    executor: SingleThreadedExecutor, capfd: pytest.CaptureFixture[str]
) -> None:
    """A callback gets the policy; without one and without the defaults nothing is said."""
    node = make(executor)
    misfits: list[Any] = []
    node.create_subscription(
        String, "x", print, LATCHED,
        event_callbacks=SubscriptionEventCallbacks(incompatible_qos=misfits.append),
    )  # fmt: skip
    node.create_publisher(
        String, "x", 1, event_callbacks=PublisherEventCallbacks(use_default_callbacks=False)
    )
    assert spin_until(executor, lambda: misfits)
    assert misfits[0].last_policy_kind == QoSPolicyKind.DURABILITY
    assert (misfits[0].total_count, misfits[0].total_count_change) == (1, 1)
    executor.spin_once(timeout_sec=0.02)
    assert "incompatible" not in capfd.readouterr().err


def test_matches_are_told(executor: SingleThreadedExecutor) -> None:
    """Both sides hear of who comes and goes."""
    node = make(executor)
    seen: dict[str, list[Any]] = {"publisher": [], "subscription": []}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # rclpy makes this handler of a deprecated class
        publisher = node.create_publisher(
            String, "x", 1,
            event_callbacks=PublisherEventCallbacks(matched=seen["publisher"].append),
        )  # fmt: skip
        subscription = node.create_subscription(
            String, "x", print, 1,
            event_callbacks=SubscriptionEventCallbacks(matched=seen["subscription"].append),
        )  # fmt: skip
    assert spin_until(executor, lambda: all(seen.values()))
    for side in seen.values():
        assert (side[0].current_count, side[0].current_count_change) == (1, 1)
        assert (side[0].total_count, side[0].total_count_change) == (1, 1)
    node.destroy_subscription(subscription)
    assert spin_until(executor, lambda: len(seen["publisher"]) == 2)
    last = seen["publisher"][1]
    assert (last.current_count, last.current_count_change, last.total_count) == (0, -1, 1)
    assert publisher.get_subscription_count() == 0


def test_missed_deadlines_are_told(executor: SingleThreadedExecutor) -> None:
    """A publisher that falls silent is told of on both sides."""
    node = make(executor)
    qos = QoSProfile(depth=1, deadline=Duration(nanoseconds=20_000_000))
    offered: list[Any] = []
    requested: list[Any] = []
    node.create_subscription(
        String, "x", lambda _: None, qos,
        event_callbacks=SubscriptionEventCallbacks(deadline=requested.append),
    )  # fmt: skip
    publisher = node.create_publisher(
        String, "x", qos, event_callbacks=PublisherEventCallbacks(deadline=offered.append)
    )
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String())
    assert spin_until(executor, lambda: offered and requested)
    assert offered[0].total_count >= offered[0].total_count_change >= 1
    assert requested[0].total_count >= 1


def test_liveliness_is_told(executor: SingleThreadedExecutor) -> None:
    """One that must say by itself that it lives loses it; saying it brings it back."""
    node = make(executor)
    qos = QoSProfile(
        depth=1, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=Duration(nanoseconds=100_000_000),
    )  # fmt: skip
    lost: list[Any] = []
    changed: list[Any] = []
    node.create_subscription(
        String, "x", print, qos,
        event_callbacks=SubscriptionEventCallbacks(liveliness=changed.append),
    )  # fmt: skip
    publisher = node.create_publisher(
        String, "x", qos, event_callbacks=PublisherEventCallbacks(liveliness=lost.append)
    )
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.assert_liveliness()
    assert spin_until(executor, lambda: lost and changed and changed[-1].not_alive_count == 1)
    assert lost[0].total_count == 1
    publisher.assert_liveliness()
    assert spin_until(executor, lambda: any(c.alive_count == 1 for c in changed))

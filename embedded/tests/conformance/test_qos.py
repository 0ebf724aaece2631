"""Quality of service: profiles, what fits, events, what latecomers get, what others can learn."""

from typing import Any

import pytest
from rclpy.duration import Duration, Infinite
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileException,
    LivelinessPolicy,
    QoSCompatibility,
    QoSDurabilityPolicy,
    QoSPolicyKind,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
    qos_policy_name_from_kind,
    qos_profile_action_status_default,
    qos_profile_best_available,
    qos_profile_default,
    qos_profile_parameter_events,
    qos_profile_parameters,
    qos_profile_sensor_data,
    qos_profile_services_default,
    qos_profile_system_default,
    qos_profile_unknown,
)
from rclpy.qos_overriding_options import (
    InvalidQosOverridesError,
    QosCallbackResult,
    QoSOverridingOptions,
)
from rclpy.topic_endpoint_info import TopicEndpointTypeEnum
from sensor_msgs.msg import Imu
from spinning import make, spin_until
from std_msgs.msg import String

LATCHED = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


def test_a_profile_has_defaults() -> None:
    """Only history or depth must be given."""
    qos = QoSProfile(depth=3)
    assert (qos.history, qos.depth) == (HistoryPolicy.KEEP_LAST, 3)
    assert qos.reliability == ReliabilityPolicy.RELIABLE
    assert qos.durability == DurabilityPolicy.VOLATILE
    assert qos.liveliness == LivelinessPolicy.SYSTEM_DEFAULT
    assert qos.lifespan == qos.deadline == qos.liveliness_lease_duration == Duration()
    assert qos.avoid_ros_namespace_conventions is False
    assert QoSProfile(history=HistoryPolicy.KEEP_ALL).depth == 10
    assert QoSDurabilityPolicy is DurabilityPolicy


def test_a_profile_is_checked() -> None:
    """Wrong types, unknown policies and missing ones are errors, at once and later."""
    for wrong in ({}, {"reliability": ReliabilityPolicy.RELIABLE}):
        with pytest.raises(InvalidQoSProfileException) as caught:
            QoSProfile(**wrong)
        assert caught.value.args == (
            "Invalid QoSProfile", "History and/or depth settings are required."
        )  # fmt: skip
    with pytest.raises(InvalidQoSProfileException, match="KEEP_LAST without a depth setting"):
        QoSProfile(history=HistoryPolicy.KEEP_LAST)
    for wrong in ({"depth": "1"}, {"depth": 1, "deadline": 1}, {"depth": 1, "nonsense": 1},
                  {"depth": 1, "avoid_ros_namespace_conventions": 1}):  # fmt: skip
        with pytest.raises(AssertionError):
            QoSProfile(**wrong)
    qos = QoSProfile(depth=1)
    qos.reliability = 2
    assert qos.reliability is ReliabilityPolicy.BEST_EFFORT
    with pytest.raises(AssertionError):
        qos.lifespan = 1.0
    with pytest.raises(ValueError, match="99"):
        qos.durability = 99
    with pytest.raises(AttributeError):
        qos.nonsense = 1
    with pytest.warns(UserWarning, match="A zero depth with KEEP_LAST doesn't make sense"):
        QoSProfile(depth=0)


def test_profiles_are_compared_and_shown() -> None:
    """By all policies; a copy changed is another."""
    assert QoSProfile(depth=1) == QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1)
    assert QoSProfile(depth=1) != QoSProfile(depth=1, deadline=Duration(seconds=1))
    assert QoSProfile(depth=1) != 1
    assert str(QoSProfile(depth=1)) == (
        "QoSProfile(history=1, depth=1, reliability=1, durability=2, lifespan=0 nanoseconds, "
        "deadline=0 nanoseconds, liveliness=0, liveliness_lease_duration=0 nanoseconds, "
        "avoid_ros_namespace_conventions=False)"
    )
    with pytest.raises(TypeError):
        hash(QoSProfile(depth=1))


def test_presets() -> None:
    """The presets have their policies and their short names."""
    assert qos_profile_default == qos_profile_services_default == QoSProfile(depth=10)
    assert qos_profile_parameters == qos_profile_parameter_events == QoSProfile(depth=1000)
    assert qos_profile_sensor_data == QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
    assert qos_profile_action_status_default == QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL
    )
    system = qos_profile_system_default
    assert (system.history, system.depth) == (HistoryPolicy.SYSTEM_DEFAULT, 0)
    assert system.reliability == ReliabilityPolicy.SYSTEM_DEFAULT
    assert qos_profile_unknown.durability == DurabilityPolicy.UNKNOWN
    assert qos_profile_best_available.liveliness == LivelinessPolicy.BEST_AVAILABLE
    assert QoSPresetProfiles.SENSOR_DATA.value == qos_profile_sensor_data
    assert QoSPresetProfiles.get_from_short_key("Sensor_Data") == qos_profile_sensor_data
    assert "services_default" in QoSPresetProfiles.short_keys()
    assert ReliabilityPolicy.short_keys() == [
        "system_default", "reliable", "best_effort", "unknown", "best_available"
    ]  # fmt: skip
    assert ReliabilityPolicy.get_from_short_key("BEST_effort") == 2
    assert DurabilityPolicy.TRANSIENT_LOCAL.short_key == "transient_local"
    assert qos_policy_name_from_kind(16) == "RELIABILITY"
    assert QoSPolicyKind.DEADLINE == 4


AUTO = {"depth": 1, "liveliness": LivelinessPolicy.AUTOMATIC}
MANUAL = {"depth": 1, "liveliness": LivelinessPolicy.MANUAL_BY_TOPIC}
SECOND = Duration(seconds=1)


@pytest.mark.parametrize(
    ("offered", "wanted", "level", "reason"),
    [
        (AUTO, AUTO, "OK", ""),
        (MANUAL, AUTO, "OK", ""),
        ({**AUTO, "reliability": ReliabilityPolicy.BEST_EFFORT}, AUTO, "ERROR",
         "ERROR: Best effort publisher and reliable subscription;"),
        ({**AUTO, "reliability": ReliabilityPolicy.BEST_EFFORT},
         {**AUTO, "durability": DurabilityPolicy.TRANSIENT_LOCAL}, "ERROR",
         "ERROR: Best effort publisher and reliable subscription;"
         "ERROR: Volatile publisher and transient local subscription;"),
        (AUTO, {**AUTO, "deadline": SECOND}, "ERROR",
         "ERROR: Subscription has a deadline, but publisher does not;"),
        ({**AUTO, "deadline": Duration(seconds=2)}, {**AUTO, "deadline": SECOND}, "ERROR",
         "ERROR: Subscription deadline is less than publisher deadline;"),
        (AUTO, MANUAL, "ERROR",
         "ERROR: Publisher's liveliness is automatic and subscription's is manual by topic;"),
        (AUTO, {**AUTO, "liveliness_lease_duration": SECOND}, "ERROR",
         "ERROR: Subscription has a liveliness lease duration, but publisher does not;"),
        ({**AUTO, "liveliness_lease_duration": Duration(seconds=2)},
         {**AUTO, "liveliness_lease_duration": SECOND}, "ERROR",
         "ERROR: Subscription liveliness lease duration is less than publisher;"),
        ({"depth": 1}, {"depth": 1}, "WARNING",
         "WARNING: Publisher liveliness is system_default and subscription liveliness is "
         "system_default;"),
        ({**AUTO, "reliability": ReliabilityPolicy.SYSTEM_DEFAULT}, AUTO, "WARNING",
         "WARNING: Reliable subscription, but publisher is system_default;"),
        ({**AUTO, "reliability": ReliabilityPolicy.BEST_EFFORT},
         {**AUTO, "reliability": ReliabilityPolicy.SYSTEM_DEFAULT}, "WARNING",
         "WARNING: Best effort publisher, but subscription is system_default;"),
        (AUTO, {**AUTO, "durability": DurabilityPolicy.SYSTEM_DEFAULT}, "WARNING",
         "WARNING: Volatile publisher, but subscription is system_default;"),
        ({"depth": 1}, MANUAL, "WARNING",
         "WARNING: Subscription's liveliness is manual by topic, but publisher's is "
         "system_default;"),
    ],
)  # fmt: skip
def test_compatibility(
    offered: dict[str, Any], wanted: dict[str, Any], level: str, reason: str
) -> None:
    """Errors with all their reasons; warnings where only the middleware knows the policy."""
    found = qos_check_compatible(QoSProfile(**offered), QoSProfile(**wanted))
    assert found == (getattr(QoSCompatibility, level), reason)


def test_what_stands_for_a_profile(executor: SingleThreadedExecutor) -> None:
    """A number is a depth; anything else is an error."""
    node = make(executor)
    assert node.create_publisher(String, "x", 7).qos_profile == QoSProfile(depth=7)
    assert node.create_subscription(String, "x", print, 7).qos_profile.depth == 7
    with pytest.raises(ValueError, match="history depth must be greater than or equal to zero"):
        node.create_publisher(String, "x", -1)
    with pytest.raises(TypeError, match="Expected QoSProfile or int, but received <class 'str'>"):
        node.create_publisher(String, "x", "7")
    with pytest.raises(RuntimeError):
        node.create_publisher(String, "x", qos_profile_unknown)


def test_types_are_checked(executor: SingleThreadedExecutor) -> None:
    """A topic has messages, a service has a service's type."""
    from std_srvs.srv import Trigger

    node = make(executor)
    with pytest.raises(AttributeError, match="This might be a ROS 1 message type"):
        node.create_publisher(str, "x", 1)
    with pytest.raises(RuntimeError, match="this might be a service or action"):
        node.create_subscription(Trigger, "x", print, 1)
    with pytest.raises(RuntimeError, match="this might be a message or action"):
        node.create_service(String, "x", print)
    with pytest.raises(AttributeError):
        node.create_client(int, "x")
    publisher = node.create_publisher(String, "x", 1)
    with pytest.raises(TypeError, match="Expected"):
        publisher.publish(Imu())


def test_latecomers_get_what_is_kept(executor: SingleThreadedExecutor) -> None:
    """As many as the depth of a latched publisher, in order; a volatile subscription gets none."""
    node = make(executor)
    publisher = node.create_publisher(String, "x", LATCHED)
    for text in "abc":
        publisher.publish(String(data=text))
    late: list[str] = []
    volatile: list[str] = []
    node.create_subscription(String, "x", lambda m: volatile.append(m.data), 10)
    deep = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(String, "x", lambda m: late.append(m.data), deep)
    assert spin_until(executor, lambda: len(late) == 2)
    assert late == ["b", "c"]
    publisher.publish(String(data="d"))
    assert spin_until(executor, lambda: len(late) == 3 and volatile)
    assert (late[2], volatile) == ("d", ["d"])


def test_depth_bounds_what_waits(executor: SingleThreadedExecutor) -> None:
    """Of many messages a slow subscription gets the last `depth`, in order."""
    node = make(executor)
    got: list[str] = []
    node.create_subscription(String, "x", lambda m: got.append(m.data), 3)
    publisher = node.create_publisher(String, "x", 50)
    assert spin_until(executor, lambda: publisher.get_subscription_count() == 1)
    for i in range(20):
        publisher.publish(String(data=str(i)))
    publisher.wait_for_all_acked()
    assert spin_until(executor, lambda: "19" in got)
    assert got == ["17", "18", "19"]


def test_what_has_outlived_its_lifespan_is_gone(executor: SingleThreadedExecutor) -> None:
    """A latecomer gets only what is young enough."""
    node = make(executor)
    short = QoSProfile(
        depth=9, durability=DurabilityPolicy.TRANSIENT_LOCAL,
        lifespan=Duration(nanoseconds=30_000_000),
    )  # fmt: skip
    publisher = node.create_publisher(String, "x", short)
    publisher.publish(String(data="old"))
    fired: list[int] = []
    node.create_timer(0.1, lambda: fired.append(1))
    assert spin_until(executor, lambda: fired)
    got: list[str] = []
    node.create_subscription(String, "x", lambda m: got.append(m.data), LATCHED)
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String(data="new"))
    assert spin_until(executor, lambda: got)
    assert got == ["new"]


def test_endpoints_are_described(executor: SingleThreadedExecutor) -> None:
    """Node, type, hash, identity and policies of each publisher and subscription of a topic."""
    node = make(executor, namespace="ns")
    offer = QoSProfile(
        depth=4, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=2),
        lifespan=Duration(seconds=3), liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=Duration(seconds=4), durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )  # fmt: skip
    node.create_publisher(String, "x", offer)
    node.create_subscription(String, "x", print, QoSProfile(history=HistoryPolicy.KEEP_ALL))
    assert spin_until(
        executor,
        lambda: all(
            infos and infos[0].node_name == "tester"
            for infos in (node.get_publishers_info_by_topic("x"),
                          node.get_subscriptions_info_by_topic("/ns/x"))
        ),
    )  # fmt: skip
    (publisher,) = node.get_publishers_info_by_topic("x")
    (subscription,) = node.get_subscriptions_info_by_topic("x")
    assert (publisher.node_name, publisher.node_namespace) == ("tester", "/ns")
    assert publisher.topic_type == subscription.topic_type == "std_msgs/msg/String"
    assert str(publisher.topic_type_hash) == str(subscription.topic_type_hash) == (
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )
    assert publisher.endpoint_type == TopicEndpointTypeEnum.PUBLISHER
    assert subscription.endpoint_type == TopicEndpointTypeEnum.SUBSCRIPTION
    assert len(publisher.endpoint_gid) == 16
    assert publisher.endpoint_gid != subscription.endpoint_gid
    assert publisher.qos_profile == offer
    wanted = subscription.qos_profile
    assert (wanted.history, wanted.depth) == (HistoryPolicy.KEEP_ALL, 0)
    assert wanted.deadline == wanted.liveliness_lease_duration == Infinite
    assert wanted.liveliness == LivelinessPolicy.AUTOMATIC
    assert "GID: " in str(publisher)
    assert str(publisher).endswith(
        "QoS profile:\n  Reliability: BEST_EFFORT\n  History (Depth): KEEP_LAST (4)\n"
        "  Durability: TRANSIENT_LOCAL\n  Lifespan: 3000000000 nanoseconds\n"
        "  Deadline: 2000000000 nanoseconds\n  Liveliness: MANUAL_BY_TOPIC\n"
        "  Liveliness lease duration: 4000000000 nanoseconds"
    )
    assert "  Deadline: Infinite\n" in str(subscription)
    assert node.get_publishers_info_by_topic("nothing") == []
    assert len(node.get_publishers_info_by_topic("rt/ns/x", no_mangle=True)) == 1


def test_open_policies_fit_what_is_there(executor: SingleThreadedExecutor) -> None:
    """`best available` becomes best effort for a publisher that is."""
    node = make(executor)
    got: list[Any] = []
    publisher = node.create_publisher(String, "x", BEST_EFFORT)
    assert spin_until(executor, lambda: node.count_publishers("x"))
    node.create_subscription(String, "x", got.append, qos_profile_best_available)
    assert spin_until(executor, publisher.get_subscription_count)

    def heard() -> bool:
        publisher.publish(String())
        return bool(got)

    assert spin_until(executor, heard)


def test_names_without_ros_conventions(executor: SingleThreadedExecutor) -> None:
    """The DDS topic is the ROS name itself, for programs without ROS."""
    node = make(executor)
    plain = QoSProfile(depth=1, avoid_ros_namespace_conventions=True)
    got: list[Any] = []
    node.create_subscription(String, "/plain", got.append, plain)
    publisher = node.create_publisher(String, "/plain", plain)
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String(data="x"))
    assert spin_until(executor, lambda: got)
    assert spin_until(executor, lambda: node.get_publishers_info_by_topic("/plain", no_mangle=True))
    assert node.count_publishers("/plain") == 0


def test_policies_from_the_command_line(executor: SingleThreadedExecutor) -> None:
    """A publisher may let parameters decide; they are read-only."""
    values = {"depth": 3, "reliability": "best_effort"}
    start = "qos_overrides./x.publisher."
    node = make(
        executor,
        parameter_overrides=[Parameter(start + name, value=v) for name, v in values.items()],
    )
    options = QoSOverridingOptions.with_default_policies()
    publisher = node.create_publisher(
        String, "x", QoSProfile(depth=1), qos_overriding_options=options
    )
    assert publisher.qos_profile == QoSProfile(depth=3, reliability=ReliabilityPolicy.BEST_EFFORT)
    assert node.get_parameter(start + "history").value == "keep_last"
    assert node.describe_parameter(start + "depth").read_only


def test_the_program_checks_policies_from_the_command_line(
    executor: SingleThreadedExecutor,
) -> None:
    """Its callback sees the profile with the parameters' values, and may refuse it."""
    start = "qos_overrides./x.subscription_a."
    node = make(executor, parameter_overrides=[Parameter(start + "depth", value=3)])

    def check(profile: QoSProfile) -> QosCallbackResult:
        return QosCallbackResult(successful=profile.depth > 3, reason="too shallow")

    options = QoSOverridingOptions.with_default_policies(callback=check, entity_id="a")
    with pytest.raises(InvalidQosOverridesError, match="too shallow"):
        node.create_subscription(String, "x", print, 10, qos_overriding_options=options)
    node.create_subscription(String, "y", print, 10, qos_overriding_options=options)
    assert node.get_parameter("qos_overrides./y.subscription_a.depth").value == 10


def test_two_arguments_bring_news_of_the_message(executor: SingleThreadedExecutor) -> None:
    """A callback with two arguments learns when the message was sent; with three it is refused."""
    node = make(executor)
    got: list[Any] = []
    node.create_subscription(String, "x", lambda m, info: got.append((m.data, info)), 1)
    publisher = node.create_publisher(String, "x", 1)
    assert spin_until(executor, publisher.get_subscription_count)
    publisher.publish(String(data="a"))
    assert spin_until(executor, lambda: got)
    text, info = got[0]
    assert text == "a"
    assert 0 < info["source_timestamp"] <= info["received_timestamp"]
    with pytest.raises(RuntimeError, match="callback should be either be callable with one"):
        node.create_subscription(String, "x", lambda a, b, c: None, 1)


def test_bytes_are_published_as_they_are(executor: SingleThreadedExecutor) -> None:
    """What a raw subscription got can be published again."""
    node = make(executor)
    got: list[Any] = []
    raw: list[bytes] = []
    node.create_subscription(String, "x", got.append, 10)
    node.create_subscription(String, "x", raw.append, 10, raw=True)
    publisher = node.create_publisher(String, "x", 10)
    assert spin_until(executor, lambda: publisher.get_subscription_count() == 2)
    publisher.publish(String(data="again"))
    assert spin_until(executor, lambda: raw)
    publisher.publish(bytes(raw[0]))
    assert spin_until(executor, lambda: len(got) == 2)
    assert got[0] == got[1] == String(data="again")

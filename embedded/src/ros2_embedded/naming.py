"""Names: ROS 2's rules for names, and how they become names of DDS topics."""

from __future__ import annotations

import re

TOPIC, REQUEST, REPLY = "rt", "rq", "rr"

_SERVICE_TYPE = re.compile(r"(.*)_(Request|Response)_")
HIDDEN_ACTION_PARTS = ("send_goal", "cancel_goal", "get_result", "feedback", "status")


def join(namespace: str, name: str) -> str:
    """Full name of a node or of a relative name in a namespace."""
    return f"{namespace.rstrip('/')}/{name}"


def topic_name(name: str) -> str:
    """DDS topic of a ROS topic: `/imu` is `rt/imu`."""
    return TOPIC + name


def dds_topic(name: str, plain: bool) -> str:
    """DDS topic of a ROS topic, or its `plain` name, for DDS programs without ROS."""
    return name if plain else topic_name(name)


def request_name(name: str) -> str:
    """DDS topic of a service's requests: `/stop` is `rq/stopRequest`."""
    return f"{REQUEST}{name}Request"


def reply_name(name: str) -> str:
    """DDS topic of a service's replies: `/stop` is `rr/stopReply`."""
    return f"{REPLY}{name}Reply"


def ros_type(dds_type: str) -> str:
    """ROS type of a DDS type: `std_msgs::msg::dds_::String_` is `std_msgs/msg/String`."""
    return dds_type.replace("::dds_::", "::").replace("::", "/").removesuffix("_")


def demangle_topic(name: str, dds_type: str) -> tuple[str, str] | None:
    """The ROS topic and type of a DDS topic; None if it is not a topic of ROS."""
    if not name.startswith(TOPIC + "/") or "::dds_::" not in dds_type:
        return None
    return name.removeprefix(TOPIC), ros_type(dds_type)


def demangle_service(name: str, dds_type: str) -> tuple[str, str] | None:
    """The ROS service and type that a DDS topic belongs to; None if there is no service."""
    match = _SERVICE_TYPE.fullmatch(dds_type)
    for prefix, suffix in ((REQUEST, "Request"), (REPLY, "Reply")):
        if match and name.startswith(prefix + "/") and name.endswith(suffix):
            return name.removeprefix(prefix).removesuffix(suffix), ros_type(match[1])
    return None


def is_hidden(name: str) -> bool:
    """Whether the lists of `ros2` leave a name out: `_action` and the like."""
    return any(part.startswith("_") for part in name.split("/"))

"""Names: ROS 2's rules for names, and how they become names of DDS topics."""

from __future__ import annotations

import re

TOPIC, REQUEST, REPLY = "rt", "rq", "rr"

_NODE = re.compile(r"[A-Za-z_]\w*")
_NAMESPACE = re.compile(r"/|(/[A-Za-z_]\w*)+")
_TOPIC_NAME = re.compile(r"(~|~/|/)?[A-Za-z_{}]\w*(/[A-Za-z_]\w*)*|~")
_SERVICE_TYPE = re.compile(r"(.*)_(Request|Response)_")
HIDDEN_ACTION_PARTS = ("send_goal", "cancel_goal", "get_result", "feedback", "status")


class InvalidNameError(ValueError):
    """A name that ROS 2 does not allow."""

    def __init__(self, kind: str, name: str) -> None:
        """Keeps the offending name."""
        super().__init__(f"Invalid {kind}: '{name}'")
        self.name = name


def check_node_name(name: str) -> None:
    """Raises InvalidNameError unless `name` is letters, digits and underscores."""
    if not _NODE.fullmatch(name):
        raise InvalidNameError("node name", name)


def normalise_namespace(namespace: str) -> str:
    """Puts the leading slash before a namespace and checks it."""
    absolute = namespace if namespace.startswith("/") else f"/{namespace}"
    if not _NAMESPACE.fullmatch(absolute):
        raise InvalidNameError("node namespace", namespace)
    return absolute


def join(namespace: str, name: str) -> str:
    """Full name of a node or of a relative name in a namespace."""
    return f"{namespace.rstrip('/')}/{name}"


def expand(name: str, node: str, namespace: str) -> str:
    """Makes a name of a topic or a service absolute; `~` stands for the node's full name."""
    if not _TOPIC_NAME.fullmatch(name) or "__" in name:
        raise InvalidNameError("topic or service name", name)
    if name.startswith("/"):
        return name
    if name.startswith("~"):
        return join(namespace, node) + name[1:]
    return join(namespace, name)


def topic_name(name: str) -> str:
    """DDS topic of a ROS topic: `/imu` is `rt/imu`."""
    return TOPIC + name


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
    """ROS topic and type of a DDS topic, None where it is none of ROS's topics."""
    if not name.startswith(TOPIC + "/") or "::dds_::" not in dds_type:
        return None
    return name.removeprefix(TOPIC), ros_type(dds_type)


def demangle_service(name: str, dds_type: str) -> tuple[str, str] | None:
    """ROS service and type that a DDS topic belongs to, or None."""
    match = _SERVICE_TYPE.fullmatch(dds_type)
    for prefix, suffix in ((REQUEST, "Request"), (REPLY, "Reply")):
        if match and name.startswith(prefix + "/") and name.endswith(suffix):
            return name.removeprefix(prefix).removesuffix(suffix), ros_type(match[1])
    return None


def is_hidden(name: str) -> bool:
    """Whether the lists of `ros2` leave a name out: `_action` and the like."""
    return any(part.startswith("_") for part in name.split("/"))

"""Finds interface definitions.

The sources are searched in this order: the packages of the ament index (`share/PKG/msg/NAME.msg`),
the files in the folder `interfaces/` of this package, and the message definitions of ROS 2 Jazzy
that rosbags contains.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_share_directory,
    get_packages_with_prefixes,
)

from ros2_embedded.jazzy import definitions
from ros2_embedded.specs import (
    DUMMY_FIELD,
    Constant,
    Field,
    FieldType,
    InterfaceError,
    MessageSpec,
    parse_message,
    split_sections,
)

KINDS = ("msg", "srv", "action")
_BUNDLED = Path(__file__).parent / "interfaces"

_DEFAULTS = {
    **{("geometry_msgs/msg/Quaternion", axis): 0.0 for axis in "xyz"},
    ("geometry_msgs/msg/Quaternion", "w"): 1.0,
    ("rcl_interfaces/msg/ParameterDescriptor", "read_only"): False,
    ("rcl_interfaces/msg/ParameterDescriptor", "dynamic_typing"): False,
    ("sensor_msgs/msg/NavSatStatus", "status"): -2,
    ("type_description_interfaces/msg/FieldType", "type_id"): 0,
}
"""Default values of Jazzy's messages, which rosbags does not contain."""

_PARTS = {
    "srv": ("_Request", "_Response"),
    "action": ("_Goal", "_Result", "_Feedback"),
}

_UUID = FieldType("unique_identifier_msgs/msg/UUID")
_EVENT = FieldType("service_msgs/msg/ServiceEventInfo")


def _service(stem: str) -> dict[str, list[tuple[str, FieldType]]]:
    """A service's event and the service itself, whose names begin with `stem`."""
    request, response = FieldType(stem + "_Request"), FieldType(stem + "_Response")
    return {
        "_Event": [
            ("info", _EVENT),
            ("request", replace(request, container="sequence", size=1)),
            ("response", replace(response, container="sequence", size=1)),
        ],
        "": [
            ("request_message", request),
            ("response_message", response),
            ("event_message", FieldType(stem + "_Event")),
        ],
    }


def _action_service(
    part: str, request: list[tuple[str, FieldType]], response: list[tuple[str, FieldType]]
) -> dict[str, list[tuple[str, FieldType]]]:
    stem = "{}" + part
    service = {part + suffix: fields for suffix, fields in _service(stem).items()}
    return {part + "_Request": request, part + "_Response": response, **service}


_DERIVED: dict[str, dict[str, list[tuple[str, FieldType]]]] = {
    "srv": {"_Event": _service("{}")["_Event"]},
    "action": {
        **_action_service(
            "_SendGoal",
            [("goal_id", _UUID), ("goal", FieldType("{}_Goal"))],
            [("accepted", FieldType("bool")), ("stamp", FieldType("builtin_interfaces/msg/Time"))],
        ),
        **_action_service(
            "_GetResult",
            [("goal_id", _UUID)],
            [("status", FieldType("int8")), ("result", FieldType("{}_Result"))],
        ),
        "_FeedbackMessage": [("goal_id", _UUID), ("feedback", FieldType("{}_Feedback"))],
    },
}
"""Messages that ROS 2 derives from a service or an action: suffix -> (field, type)."""

_WHOLE = {
    "srv": _service("{}")[""],
    "action": [
        ("goal", FieldType("{}_Goal")),
        ("result", FieldType("{}_Result")),
        ("feedback", FieldType("{}_Feedback")),
        ("send_goal_service", FieldType("{}_SendGoal")),
        ("get_result_service", FieldType("{}_GetResult")),
        ("feedback_message", FieldType("{}_FeedbackMessage")),
    ],
}
"""The fields of a service and of an action as types of their own; only their hashes are used."""


def _from_rosbags(name: str) -> MessageSpec | None:
    """Converts a definition of rosbags: constants, and fields as (name, (node, details))."""
    definition = definitions().get(name)
    if definition is None:
        return None
    constants = []
    for constant, kind, value in definition[0]:
        constants.append(Constant(constant, kind, bytes([value]) if kind == "byte" else value))
    fields = []
    for field, (node, details) in definition[1]:
        if field == DUMMY_FIELD:
            continue
        container, size = "", 0
        if node.name in ("ARRAY", "SEQUENCE"):
            container = node.name.lower()
            (node, details), size = details
        base, bound = (details, 0) if node.name == "NAME" else details
        kind = FieldType(base, container, size, bound or 0)
        fields.append(Field(field, kind, _DEFAULTS.get((name, field))))
    return MessageSpec(name, tuple(fields), tuple(constants))


def interface_file(name: str) -> Path | None:
    """The file that defines `pkg/kind/Name`; None if there is no file."""
    package, kind, short = name.split("/")
    roots = [_BUNDLED / package]
    with suppress(PackageNotFoundError):
        roots.insert(0, Path(get_package_share_directory(package)))
    for root in roots:
        path = root / kind / f"{short}.{kind}"
        if path.is_file():
            return path
    return None


def interface_text(name: str) -> str:
    """The source text of `pkg/kind/Name`; it is made from the fields if there is no file.

    Raises:
        InterfaceError: there is no such interface.
    """
    path = interface_file(name)
    if path is not None:
        return path.read_text(encoding="utf-8")
    spec = message_spec(name)
    lines = [f"{c.type} {c.name}={_plain(c.value)}" for c in spec.constants]
    lines += [
        f"{f.type} {f.name}" if f.default is None else f"{f.type} {f.name} {_plain(f.default)}"
        for f in spec.fields
    ]
    return "".join(line + "\n" for line in lines)


def _plain(value: Any) -> Any:
    """A default value or a constant as definitions write it, such as `0` or `false`."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, bytes):
        return value[0]
    return int(value) if isinstance(value, float) and value.is_integer() else value


@cache
def message_spec(name: str) -> MessageSpec:
    """Definition of a message, of a service's half or of an action's part.

    Args:
        name: `pkg/msg/Name`, `pkg/srv/Name_Request`, `pkg/action/Name_Goal`, ...

    Raises:
        InterfaceError: there is no such interface, or its file cannot be read.
    """
    package, kind, short = name.split("/")
    if kind not in KINDS:
        raise InterfaceError(f"'{name}' is no interface name")
    if kind == "msg":
        path = interface_file(name)
        spec = parse_message(name, path.read_text("utf-8")) if path else _from_rosbags(name)
        if spec is None:
            raise InterfaceError(f"Unknown message type '{name}'")
        return spec
    for suffix, fields in _DERIVED.get(kind, {}).items():
        if short.endswith(suffix):
            stem = f"{package}/{kind}/{short.removesuffix(suffix)}"
            require_file(stem)
            return MessageSpec(
                name, tuple(Field(f, replace(t, base=t.base.format(stem))) for f, t in fields)
            )
    for index, suffix in enumerate(_PARTS.get(kind, ())):
        if short.endswith(suffix):
            whole = f"{package}/{kind}/{short.removesuffix(suffix)}"
            text = require_file(whole).read_text(encoding="utf-8")
            sections = split_sections(whole, text, len(_PARTS[kind]))
            return parse_message(name, sections[index])
    require_file(name)
    return MessageSpec(
        name, tuple(Field(f, replace(t, base=t.base.format(name))) for f, t in _WHOLE[kind])
    )


def require_file(name: str) -> Path:
    """The file that defines `pkg/kind/Name`; it must exist.

    Raises:
        InterfaceError: there is no such interface.
    """
    path = interface_file(name)
    if path is None:
        raise InterfaceError(f"Unknown interface type '{name}'")
    return path


def list_interfaces(package: str, kind: str) -> list[str]:
    """The short names of a package's interfaces of one kind (`msg`, `srv` or `action`)."""
    names: set[str] = set()
    roots = [_BUNDLED / package]
    with suppress(PackageNotFoundError):
        roots.append(Path(get_package_share_directory(package)))
    for root in roots:
        names.update(path.stem for path in (root / kind).glob(f"*.{kind}"))
    if kind == "msg":
        prefix = f"{package}/msg/"
        names.update(n.removeprefix(prefix) for n in definitions() if n.startswith(prefix))
    return sorted(names)


def list_packages() -> list[str]:
    """The names of all packages that have interfaces."""
    names = {name.split("/")[0] for name in definitions()}
    names.update(path.name for path in _BUNDLED.iterdir())
    names.update(
        package
        for package in get_packages_with_prefixes()
        if any(list_interfaces(package, kind) for kind in KINDS)
    )
    return sorted(names)


def full_name(name: str, kind: str) -> str:
    """Completes `pkg/Name` to `pkg/kind/Name`.

    Raises:
        InterfaceError: the name has another form.
    """
    parts = name.split("/")
    if len(parts) == 2:
        parts.insert(1, kind)
    if len(parts) != 3 or parts[1] not in KINDS or not all(parts):
        raise InterfaceError(f"'{name}' is no interface name: pkg/{kind}/Name expected")
    return "/".join(parts)

"""Makes the modules `pkg.msg`, `pkg.srv` and `pkg.action` of an interface package."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from ros2_embedded.catalogue import KINDS, list_interfaces, message_spec
from ros2_embedded.messages import message_class
from ros2_embedded.thread_safety import once


def _group(name: str, parts: dict[str, str]) -> type:
    """Class that only holds others, as `Trigger` holds `Trigger.Request`."""
    package, kind, short = name.split("/")
    members = {attr: message_class(name + suffix) for attr, suffix in parts.items()}

    def refuse(self: Any) -> None:
        what = {"srv": "Service", "action": "Action"}[kind]
        raise NotImplementedError(f"{what} classes can not be instantiated")

    own = {"_name": name, "__module__": f"{package}.{kind}", "__init__": refuse}
    return type(short, (), {**own, **members})


@once
def service_class(name: str) -> Any:
    """Class of a service `pkg/srv/Name`, with `Request` and `Response`."""
    message_spec(name + "_Request")
    return _group(name, {"Request": "_Request", "Response": "_Response"})


@once
def action_class(name: str) -> Any:
    """Class of an action `pkg/action/Name`, with `Goal`, `Result`, `Feedback` and `Impl`."""
    group: Any = _group(name, {"Goal": "_Goal", "Result": "_Result", "Feedback": "_Feedback"})
    impl = type("Impl", (), {"FeedbackMessage": message_class(name + "_FeedbackMessage")})
    impl.GoalStatusMessage = message_class("action_msgs/msg/GoalStatusArray")  # type: ignore[attr-defined]
    impl.SendGoalService = service_class(name + "_SendGoal")  # type: ignore[attr-defined]
    impl.GetResultService = service_class(name + "_GetResult")  # type: ignore[attr-defined]
    impl.CancelGoalService = service_class("action_msgs/srv/CancelGoal")  # type: ignore[attr-defined]
    group.Impl = impl
    return group


_MAKERS = {"msg": message_class, "srv": service_class, "action": action_class}


def interface_class(name: str) -> Any:
    """Class of the interface `pkg/kind/Name`."""
    return _MAKERS[name.split("/")[1]](name)


class _InterfaceModule(ModuleType):
    """Module whose classes are made when they are first asked for."""

    def __getattr__(self, attr: str) -> Any:
        package, kind = self.__name__.rsplit(".", 1)
        names = list_interfaces(package, kind)
        if attr == "__all__":
            return names
        stem = attr.split("_")[0]
        if attr.startswith("_") or stem not in names:
            raise AttributeError(f"module '{self.__name__}' has no attribute '{attr}'")
        maker = _MAKERS[kind] if attr == stem else message_class
        value = maker(f"{package}/{kind}/{attr}")
        setattr(self, attr, value)
        return value

    def __dir__(self) -> list[str]:
        package, kind = self.__name__.rsplit(".", 1)
        return list_interfaces(package, kind)


def provide(package: str) -> None:
    """Puts the modules of an interface package into `sys.modules`; called by the package itself."""
    for kind in KINDS:
        module = _InterfaceModule(f"{package}.{kind}", f"Interfaces of {package}, as in its files.")
        sys.modules[module.__name__] = module
        setattr(sys.modules[package], kind, module)

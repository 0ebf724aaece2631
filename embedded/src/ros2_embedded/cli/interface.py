"""`ros2 interface`: show, list, package, packages, proto."""

from __future__ import annotations

import argparse

from ros2_embedded.catalogue import KINDS, full_name, list_interfaces, list_packages
from ros2_embedded.cli import interface_show
from ros2_embedded.cli.common import CliError, Define, Verb, define_verbs, flag, option
from ros2_embedded.specs import InterfaceError

_TITLES = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}
_NOUNS = {"msg": "message", "srv": "service", "action": "action"}


def _kind_flags(text: str) -> list[Define]:
    """The options that ask for one kind of interfaces only."""
    return [
        flag(f"-{kind[0]}", f"--only-{kind}s", text=text.format(noun))
        for kind, noun in _NOUNS.items()
    ]


def _kinds(options: argparse.Namespace) -> list[str]:
    """The kinds that the options select; without an option, all kinds."""
    return [kind for kind in KINDS if getattr(options, f"only_{kind}s")] or list(KINDS)


def _list(options: argparse.Namespace) -> None:
    for kind in _kinds(options):
        print(_TITLES[kind])
        for package in list_packages():
            for short in list_interfaces(package, kind):
                print(f"    {package}/{kind}/{short}")


def _package(options: argparse.Namespace) -> str | None:
    package = options.package_name
    if package not in list_packages():
        return f"Unknown package '{package}'"
    for kind in _kinds(options):
        for short in list_interfaces(package, kind):
            print(f"{package}/{kind}/{short}")
    return None


def _packages(options: argparse.Namespace) -> None:
    for package in list_packages():
        if any(list_interfaces(package, kind) for kind in _kinds(options)):
            print(package)


def _proto(options: argparse.Namespace) -> None:
    from ros2_embedded.message_modules import interface_class  # Cyclone DDS: only this verb's
    from ros2_embedded.message_text import to_yaml

    try:
        found = interface_class(full_name(options.type, "msg"))
    except InterfaceError as error:
        raise CliError(str(error)) from error
    part = getattr(found, "Goal", getattr(found, "Request", found))
    text = to_yaml(part())
    print(text if options.no_quotes else f'"{text}"')


_ONLY = _kind_flags("Print out only the {} types")
_VERBS = {
    "list": Verb("List all interface types available", _list, *_ONLY),
    "package": Verb(
        "Output a list of available interface types within one package",
        _package,
        *_ONLY,
        option("package_name", help="Name of the ROS package (e.g. 'example_interfaces')"),
    ),
    "packages": Verb(
        "Output a list of packages that provide interfaces",
        _packages,
        *_kind_flags("Only list packages that generate {}s"),
    ),
    "proto": Verb(
        "Output an interface prototype",
        _proto,
        option("type", help="Show an interface definition (e.g. 'example_interfaces/msg/String')"),
        flag("--no-quotes", text="if true output has no outer quotes."),
    ),
    "show": Verb("Output the interface definition", interface_show.show, *interface_show.OPTIONS),
}


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the verbs of `ros2 interface`."""
    define_verbs(parser, _VERBS)

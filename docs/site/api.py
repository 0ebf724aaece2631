"""Makes the pages of the API: one for each room (sub-package) of each package, from the docstrings.

The pages are read from the tree, so that a new module or room needs no entry anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import griffe

SOURCE = Path(__file__).resolve().parents[2] / "ros2_ws" / "src"
FOLDER = "api"
_ABOUT = ("The pages of this section are made from the docstrings in the code. Each page shows one "
          "room (sub-package) of a package; what the rooms are for is in "
          "[architecture](../architecture.md#rooms).")


def packages() -> list[str]:
    """Names of the Python packages, in the order of the alphabet."""
    return sorted(path.parent.name for path in SOURCE.glob("*/*/__init__.py")
                  if path.parent.name == path.parent.parent.name)


def _folder(package: str) -> Path:
    return SOURCE / package / package


def _rooms(package: str) -> list[str]:
    return sorted(path.parent.name for path in _folder(package).glob("*/__init__.py"))


def _modules(folder: Path) -> list[str]:
    """Dotted names of the public modules below a folder, relative to it."""
    paths = (path.relative_to(folder).with_suffix("") for path in folder.rglob("*.py"))
    names = (".".join(path.parts) for path in paths)
    return sorted(name for name in names
                  if not any(part.startswith("_") for part in name.split(".")))


def _page(title: str, modules: list[str]) -> str:
    return "\n\n".join([f"# {title}", *(f"::: {name}" for name in modules)]) + "\n"


def pages() -> dict[str, str]:
    """Markdown of each page, by its place in the site."""
    found = {f"{FOLDER}/index.md": f"# API\n\n{_ABOUT}\n\n" + "".join(
        f"- [`{name}`]({name}/index.md)\n" for name in packages())}
    for package in packages():
        folder, rooms = _folder(package), _rooms(package)
        top = [f"{package}.{name}" for name in _modules(folder)
               if name.partition(".")[0] not in rooms]
        text = _page(package, top)
        if rooms:
            listed = "".join(f"- [`{package}.{room}`]({room}.md)\n" for room in rooms)
            text = text.replace("\n\n", f"\n\n{listed}\n", 1)
        found[f"{FOLDER}/{package}/index.md"] = text
        for room in rooms:
            modules = [f"{package}.{room}.{name}" for name in _modules(folder / room)]
            found[f"{FOLDER}/{package}/{room}.md"] = _page(f"{package}.{room}", modules)
    return found


def nav() -> list[object]:
    """Entries of the section for the site's table of contents."""
    entries: list[object] = [f"{FOLDER}/index.md"]
    for package in packages():
        rooms = [{room: f"{FOLDER}/{package}/{room}.md"} for room in _rooms(package)]
        entries.append({package: [f"{FOLDER}/{package}/index.md", *rooms]})
    return entries



def undocumented(package: str, folder: Path | None = None) -> list[str]:
    """Dotted names of a package's public modules, classes and functions without a docstring.

    Args:
        package: Name of the package.
        folder: Folder in which it lies; None means its place in the workspace.
    """
    tree = griffe.load(package, search_paths=[folder or SOURCE / package])
    return [thing.path for thing in _public(tree) if not thing.has_docstring]


def _public(thing: griffe.Object) -> Iterator[griffe.Object]:
    """A module or class and everything public that is defined in it."""
    yield thing
    for name, member in thing.members.items():
        if member.is_alias or name.startswith("_"):
            continue
        if member.is_module or member.is_class:
            yield from _public(member)
        elif member.is_function:
            yield member

"""Brings pages that live outside docs/ into the site, and turns links between them into the site's.

The README is the front page, so that it is written once and readable on a code host as well.
MkDocs calls the functions `on_...` by their names (https://www.mkdocs.org/dev-guide/plugins/).
"""

from __future__ import annotations

import posixpath
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))  # MkDocs loads a hook without its folder
import api

ROOT = Path(__file__).resolve().parents[2]
# Pages outside docs/, by their path in the repository, and their places in the site.
PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "LICENSE": "license.md",
    "ros2_commands/README.md": "ros2_commands.md",
}
# Code, or what stands before the target of a link or of a reference's definition, and the target.
LINK = re.compile(
    r"^[ \t]*(?P<fence>`{3,}|~{3,})[^`\n]*\n.*?^[ \t]*(?P=fence)[ \t]*$"
    r"|(?<!`)(?P<ticks>`+)(?!`)(?:(?!\n[ \t]*\n).)*?(?<!`)(?P=ticks)(?!`)"
    r"|(?P<before>\]\([ \t\n]*<?|^ {0,3}\[[^\]\n]+\]:[ \t]*<?)(?P<target>[^)>\s#]+)",
    re.DOTALL | re.MULTILINE)
OTHER_FILES = "files"  # folder of the site for linked files that are no pages, such as a module


def on_config(config: Any) -> Any:
    """Put the pages of the API into the table of contents.

    Raises:
        PluginError: A public name has no docstring.
    """
    missing = [name for package in api.packages() for name in api.undocumented(package)]
    if missing:
        raise PluginError(f"public names without a docstring: {', '.join(missing)}")
    for section in config.nav:
        if "API" in section:
            section["API"] = api.nav()
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of `PAGES`, and the other files outside docs/ to which a page links."""
    for source, place in PAGES.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        if not source.endswith(".md"):
            text = f"# License\n\n```\n{text}```\n"
        files.append(File.generated(config, place, content=text))
    for place, text in api.pages().items():
        files.append(File.generated(config, place, content=text))
    linked = {found for page in files.documentation_pages() if page.src_uri.endswith(".md")
              for found in _targets(page) if not _is_in_site(found)}
    for path in sorted(linked):
        if (ROOT / path).is_file():
            files.append(File.generated(
                config, f"{OTHER_FILES}/{path}.txt", content=(ROOT / path).read_bytes()))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Turn links that are right in the repository into links that are right in the site."""
    here = posixpath.dirname(page.file.src_uri)

    def rewritten(match: re.Match[str]) -> str:
        target = _in_repository(page.file, match["target"]) if match["target"] else None
        if target is None or not (ROOT / target).exists():
            return match[0]
        return match["before"] + posixpath.relpath(_place(target), here or ".")

    return LINK.sub(rewritten, markdown)


def _targets(page: File) -> list[str]:
    """Paths in the repository of the files to which a page links."""
    found = (_in_repository(page, match["target"])
             for match in LINK.finditer(page.content_string) if match["target"])
    return [path for path in found if path is not None]


def _in_repository(page: File, link: str) -> str | None:
    """Path in the repository of the target of a page's link; None for one outside it."""
    if re.match(r"[a-z]+:|/", link):
        return None
    outside = {place: source for source, place in PAGES.items()}
    source = outside.get(page.src_uri, f"docs/{page.src_uri}")
    path = posixpath.normpath(posixpath.join(posixpath.dirname(source), link))
    return None if path.startswith("..") else path


def _is_in_site(path: str) -> bool:
    return path in PAGES or path.startswith("docs/")


def _place(path: str) -> str:
    """Place in the site of a file of the repository."""
    if path in PAGES:
        return PAGES[path]
    return path.removeprefix("docs/") if path.startswith("docs/") else f"{OTHER_FILES}/{path}.txt"

"""`ros2 bag info`."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import yaml
from rosbags.rosbag2 import Reader, ReaderError

from ros2_embedded.cli.common import CliError, flag, option

_NANOSECONDS = 1_000_000_000
_INDENT = " " * 19


def _existing(text: str) -> Path:
    path = Path(text)
    if not path.exists():
        raise argparse.ArgumentTypeError(f"Bag path '{text}' does not exist!")
    return path


OPTIONS = (
    option("bag_path", type=_existing, help="Bag to open"),
    option("-s", "--storage", default="", choices=["mcap", "sqlite3"],
           help="Storage implementation of bag. By default attempts to detect automatically - use "
           "this argument to override."),
    flag("-t", "--topic-name", text="Only display topic names."),
    flag("-v", "--verbose", text="Display request/response information for services"),
)  # fmt: skip


def info(options: argparse.Namespace) -> None:
    """Prints what is in a bag."""
    if options.topic_name and options.verbose:
        print(
            "Warning! You have set both the '-t' and '-v' parameters. The '-t' parameter will be "
            "ignored."
        )
    try:
        with Reader(options.bag_path) as reader:
            text = report(reader, options.bag_path, with_services=not options.verbose)
            topics = [connection.topic for connection in reader.connections]
    except (ReaderError, OSError) as error:
        raise CliError(f"[ERROR] [ros2bag]: {error}") from error
    print("\n".join(topics) if options.topic_name and not options.verbose else text)


def report(reader: Reader, path: Path, *, with_services: bool) -> str:
    """Describes an open bag."""
    files, storage, distro = _facts(path)
    folder = path if path.is_dir() else path.parent
    size = sum((folder / name).stat().st_size for name in files)
    start, end = (reader.start_time, reader.end_time - 1) if reader.message_count else (0, 0)
    topics = [
        f"Topic: {c.topic} | Type: {c.msgtype} | Count: {c.msgcount} | Serialization Format: cdr"
        for c in reader.connections
    ]
    lines = [
        "",
        f"Files:             {_column(files)}",
        f"Bag size:          {_size(size)}",
        f"Storage id:        {storage}",
        f"ROS Distro:        {distro}",
        f"Duration:          {_seconds(end - start)}s",
        f"Start:             {_date(start)}",
        f"End:               {_date(end)}",
        f"Messages:          {reader.message_count}",
        f"Topic information: {_column(topics)}",
    ]
    if with_services:
        lines += ["Service:           0", "Service information: "]
    return "\n".join(lines)


def _facts(path: Path) -> tuple[list[str], str, str]:
    """The file names, the storage and the ROS distribution, which is unknown for a single file."""
    if path.is_file():
        return [path.name], {".db3": "sqlite3"}.get(path.suffix, "mcap"), "unknown"
    tree = yaml.safe_load((path / "metadata.yaml").read_text("utf-8"))
    facts: dict[str, Any] = tree["rosbag2_bagfile_information"]
    distro = facts.get("ros_distro") or "unknown"
    return facts["relative_file_paths"], facts["storage_identifier"], distro


def _column(texts: list[str]) -> str:
    return f"\n{_INDENT}".join(texts)


def _size(size: float) -> str:
    for unit in ("B", "KiB", "MiB", "GiB"):
        if size < 1024:
            return f"{size:.{0 if unit == 'B' else 1}f} {unit}"
        size /= 1024
    return f"{size:.1f} TiB"


def _seconds(nanoseconds: int) -> str:
    return f"{nanoseconds // _NANOSECONDS}.{nanoseconds % _NANOSECONDS:09d}"


def _date(nanoseconds: int) -> str:
    local = time.localtime(nanoseconds // _NANOSECONDS)
    text = time.strftime("%b %e %Y %H:%M:%S", local)
    return f"{text}.{nanoseconds % _NANOSECONDS:09d} ({_seconds(nanoseconds)})"

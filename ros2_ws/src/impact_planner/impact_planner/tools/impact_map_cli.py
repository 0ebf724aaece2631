"""Command ``impact_map``: how far each run-up can open doors, and what stops larger angles."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections import Counter
from collections.abc import Sequence

from door_impact_common.errors import DoorImpactError
from door_impact_common.files import make_folder, write_whole
from door_model.door.config import door_names, load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from tqdm import tqdm

from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import ENDINGS
from impact_planner.tools.impact_map import (
    LIMITS,
    Cell,
    MapRange,
    cell_object,
    csv_text,
    map_cells,
    table,
)

_EXAMPLE = """\
example, the paper's door and three doors with closers of EN 1154 (takes some minutes):
  ros2 run impact_planner impact_map
a finer map of the paper's door alone:
  ros2 run impact_planner impact_map --doors paper --angles $(seq 10 60) --restitutions 0.4 0.5 0.6
writes into out/impact_map:
  impact_map.csv    every request: v_rB, ZMP margins until the hit and overall, step, or refusal
  impact_map.png    a panel for each door
"""
_DOORS = ("paper", "size2", "size3", "size4")
_RESTITUTIONS = (0.0, 0.1, 0.2, 0.3, 0.5, 0.7)


def build_parser() -> argparse.ArgumentParser:
    """Make the parser of the command's arguments."""
    parser = argparse.ArgumentParser(
        prog="impact_map",
        description="Plan impacts over doors, opening angles and restitution with each run-up. The "
        "planner chooses where the robot stands. Print the largest angles, and write a table and "
        "a picture.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--doors",
        nargs="+",
        default=_DOORS,
        metavar="NAME_OR_YAML",
        help=f"{', '.join(door_names())}, or YAML files (default: {' '.join(_DOORS)})",
    )
    parser.add_argument(
        "--angles", nargs="+", type=float, default=[float(x) for x in range(10, 61, 5)],
        metavar="DEG", help="opening angles (default: 10 to 60 in steps of 5)")
    parser.add_argument(
        "--restitutions", nargs="+", type=float, default=_RESTITUTIONS, metavar="E",
        help="coefficients of restitution, 0 to 1 (default: "
        f"{' '.join(map(str, _RESTITUTIONS))})")
    parser.add_argument(
        "--ending", choices=ENDINGS, default=ENDINGS[0],
        help="phase after the door's largest angle (default: %(default)s)")
    parser.add_argument(
        "--out", default="out/impact_map", metavar="DIR",
        help="folder for the files (default: %(default)s); files of the same name are replaced")
    parser.add_argument(
        "--json", action="store_true", help="print one JSON object, with every request")
    return parser


def main(args: list[str] | None = None) -> int:
    """Run the command.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        Exit status: 0, or 1 after a failure, whose reason is printed on stderr.
    """
    options = build_parser().parse_args(args)
    try:
        from impact_planner.tools.map_drawing import map_picture
    except ImportError:
        print("impact_map: matplotlib is missing: pip install matplotlib", file=sys.stderr)
        return 1
    try:
        over = MapRange(
            doors=tuple(_known(name) for name in dict.fromkeys(options.doors)),
            angles=tuple(math.radians(angle) for angle in sorted(set(options.angles))),
            restitutions=tuple(sorted(set(options.restitutions))),
            ending=options.ending,
        )
        folder = make_folder(options.out)
        robot = RobotModel(load_robot_config())
        # The progress bar appears in a terminal only; elsewhere stderr is for errors.
        cells = list(tqdm(map_cells(over, robot), total=len(over), unit="plan", disable=None))
        files: dict[str, str | bytes] = {
            "impact_map.csv": csv_text(cells), "impact_map.png": map_picture(over, cells)}
        for name, content in files.items():
            write_whole(folder / name, content)
    except DoorImpactError as error:
        print(f"impact_map: {error}", file=sys.stderr)
        return 1
    print(_answer(over, cells, [str(folder / name) for name in files], options.json))
    return 0


def _known(name_or_path: str) -> KnownDoor:
    """A configured door by its name or the path of its file, taken as exact."""
    return KnownDoor.configured(load_door(name_or_path))


def _answer(over: MapRange, cells: Sequence[Cell], files: Sequence[str], as_json: bool) -> str:
    """The text that the command prints."""
    if as_json:
        return json.dumps({"ending": over.ending, "cells": list(map(cell_object, cells)),
                           "files": files})
    refused = Counter(LIMITS[cell.limit] for cell in cells if not cell.feasible)
    why = ", ".join(f"{words} {count}" for words, count in refused.most_common())
    return "\n".join([
        table(cells), "",
        f"{len(cells) - refused.total()} of {len(cells)} requests can be planned; refused: "
        f"{why or 'none'}",
        "written: " + ", ".join(files)])


if __name__ == "__main__":
    sys.exit(main())

"""Command `ros2 run door_model identify`: identifies a door's parameters from a recording."""

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from door_impact_common.files import run_command, write_whole

from door_model.door.config import load_geometry
from door_model.door.geometry import DoorGeometry
from door_model.errors import DoorParameterError
from door_model.identification.identify import Identification, Window, identify
from door_model.identification.parameters import RATIO_OF
from door_model.identification.scale import (
    FORCE_STD,
    LEVER_STD,
    ForceGauge,
    ForceReading,
    KnownImpulse,
    Reference,
    scale_from_inertia,
    scale_from_leaf,
)
from door_model.identification.trajectory_fit import EXTRAS
from door_model.recording.mcap import read_mcap
from door_model.recording.recording import COUNTS_PER_TURN, read_csv
from door_model.tools.report import as_comment, as_config, as_table, identified

_DESCRIPTION = """\
Identify a swing door with a closer from a recording of pushes by hand, section IV.A of the paper.

Free swings fix only the ratios of the parameters. One further measurement fixes their scale: mass
and width of the leaf (--mass and --width, or those of --door), its moment of inertia, readings of a
force gauge, or a push whose impulse is known."""

_EXAMPLE = """\
recording: a CSV with the header time_s,count or time_s,angle_deg, or an MCAP file with
/door_encoder/samples, or else raw counts on /door_encoder/counts, made by `record:=FILE` or
`ros2 bag record -s mcap`. Push the shut door five times by hand, to 10 .. 30 deg, let go at once
and let it fall shut each time.

example, with the recording that comes with this package (it was simulated by `python -m
door_model.recording.synthetic`, not measured on a door):
  ros2 run door_model identify --mass 47.62 --width 0.896 --yaml my_door.yaml \\
      --csv $(ros2 pkg prefix --share door_model)/recordings/paper_five_swings.csv
  ros2 run impact_planner plan --angle-deg 25 --door my_door.yaml
"""


def _parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="identify", description=_DESCRIPTION, epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--csv", metavar="FILE", help="recording")
    source.add_argument("--mcap", metavar="FILE", help="recording of the topics")
    parser.add_argument(
        "--topic", metavar="NAME", help="topic of --mcap, such as /robot1/door_encoder/counts "
        "(default: /door_encoder/samples, or else /door_encoder/counts)")
    _add_scale(parser)
    parser.add_argument(
        "--door",
        metavar="YAML",
        help="door whose linkage is used, and whose leaf is used without --mass and --width; its "
        "closer's parameters are ignored. Without --door the linkage is that of the paper's door: "
        "measure your own (docs/door.md)",
    )
    parser.add_argument(
        "--counts-per-turn",
        type=int,
        metavar="N",
        help="counts in a turn of the hinge, for a CSV with counts (otherwise "
        f"{COUNTS_PER_TURN} are assumed); an MCAP file contains this number",
    )
    _add_fit(parser)
    parser.add_argument(
        "--restitution",
        type=float,
        default=0.5,
        metavar="E",
        help="coefficient of restitution to write to --yaml (default %(default)s); it cannot be "
        "identified from swings by hand",
    )
    parser.add_argument(
        "--force", action="store_true",
        help="accept a closer whose torque at the shut door no closer of EN 1154 has")
    parser.add_argument("--yaml", metavar="OUT", help="write the door for the planner")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser


def _add_scale(parser: argparse.ArgumentParser) -> None:
    """Add the options for the measurement that fixes the scale."""
    parser.add_argument(
        "--mass",
        type=float,
        metavar="KG",
        help="mass of the leaf [kg]; with --width it fixes the scale, unless --inertia, --gauge or "
        "--impulse does",
    )
    parser.add_argument(
        "--width", type=float, metavar="M", help="distance from the hinge to the free edge [m]")
    scale = parser.add_mutually_exclusive_group()
    scale.add_argument(
        "--inertia", type=float, nargs=2, metavar=("KG_M2", "STD"),
        help="moment of inertia about the hinge and its standard deviation [kg m^2]")
    scale.add_argument(
        "--gauge",
        type=float,
        nargs=3,
        action="append",
        metavar=("DEG", "N", "M"),
        help="a force gauge holds the door still: opening angle [deg], force [N] at a right angle "
        "to the leaf, its distance from the hinge [m]; their standard deviations are assumed to be "
        f"{FORCE_STD:g} N and {LEVER_STD * 1e3:g} mm; may be repeated",
    )
    scale.add_argument(
        "--impulse",
        type=float,
        nargs=3,
        metavar=("NMS", "STD", "SWING"),
        help="angular impulse about the hinge of a push while the leaf moved, its standard "
        "deviation [N m s], and the number of the swing that it caused (the first is 1)",
    )


def _add_fit(parser: argparse.ArgumentParser) -> None:
    """Add the options for what is fitted."""
    parser.add_argument(
        "--window",
        choices=[window.value for window in Window],
        default=Window.AUTO.value,
        help="fit opening alone, as the paper does, or the whole swing (default: the whole swing "
        "if closing follows the model)",
    )
    parser.add_argument(
        "--also",
        nargs="+",
        action="extend",
        choices=list(EXTRAS),
        default=[],
        help="identify more than the paper: friction at the hinge, or a backcheck or a latch zone "
        "in which the closer has another viscosity",
    )
    parser.add_argument(
        "--bound",
        nargs=3,
        action="append",
        default=[],
        metavar=("NAME", "LOW", "HIGH"),
        help="bounds of a parameter in SI units; NAME is one of "
        f"{', '.join(RATIO_OF)}; may be repeated",
    )
    parser.add_argument(
        "--zero-std-deg", type=float, metavar="DEG",
        help="standard deviation of the encoder's zero at the closed door (default: half a count)")
    parser.add_argument(
        "--from-deg",
        type=float,
        metavar="DEG",
        help="fit from this angle, as the paper does from 10 deg (default: from where the data "
        "show that the hand has left)",
    )


def _reference(arguments: argparse.Namespace, mass: float | None, width: float | None) -> Reference:
    """Return the measurement that fixes the scale."""
    if arguments.inertia:
        return scale_from_inertia(*arguments.inertia)
    if arguments.gauge:
        readings = [
            ForceReading(math.radians(angle), force, lever)
            for angle, force, lever in arguments.gauge
        ]
        return ForceGauge(readings)
    if arguments.impulse:
        impulse, std, swing = arguments.impulse
        return KnownImpulse(impulse, std, swing)
    return scale_from_leaf(mass, width)


def _run(arguments: argparse.Namespace) -> tuple[Identification, DoorGeometry]:
    """Identify the door, and return it with its leaf and linkage."""
    geometry = load_geometry(arguments.door or "paper")
    mass: float | None = arguments.mass
    width: float | None = arguments.width
    if arguments.door:
        mass = geometry.leaf.mass if mass is None else mass
        width = geometry.leaf.width if width is None else width
    scale = _reference(arguments, mass, width)
    leaf = geometry.leaf
    leaf = replace(leaf, mass=mass or leaf.mass, width=width or leaf.width)
    name = "identified" if arguments.yaml is None else Path(arguments.yaml).stem
    geometry = replace(
        geometry.with_leaf(leaf), name=geometry.name if arguments.door else name)
    if arguments.mcap:
        recording = read_mcap(arguments.mcap, arguments.topic)
    else:
        recording = read_csv(arguments.csv, arguments.counts_per_turn)
    result = identify(
        recording, geometry.linkage, scale, window=arguments.window,
        start_angle=_radians(arguments.from_deg), extras=arguments.also,
        bounds=_bounds(arguments.bound), zero_std=_radians(arguments.zero_std_deg),
        leaf=leaf if mass and width else None, force=arguments.force)
    if mass is None:  # a mass that agrees with I_A
        mass = 3.0 * result.door.i_a / leaf.width**2
        geometry = replace(geometry, leaf=replace(leaf, mass=mass))
    return result, geometry


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else math.radians(degrees)


def _bounds(typed: Sequence[Sequence[str]]) -> dict[str, tuple[float, float]]:
    """Parse the bounds.

    Raises:
        DoorParameterError: A parameter has two bounds, or a bound is not a number.
    """
    bounds: dict[str, tuple[float, float]] = {}
    for name, low, high in typed:
        if name in bounds:
            raise DoorParameterError(f"bounds of {name}", f"{low} {high}", "given once")
        try:
            bounds[name] = float(low), float(high)
        except ValueError:
            raise DoorParameterError(f"bounds of {name}", f"{low} {high}", "two numbers") from None
    return bounds


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; the exit code is 1 for errors."""
    parser = _parser()
    arguments = parser.parse_args(argv)
    if not 0.0 <= arguments.restitution <= 1.0:
        parser.error(f"--restitution must be 0 to 1, not {arguments.restitution}")
    source = arguments.mcap or arguments.csv
    if arguments.yaml is not None and Path(arguments.yaml).resolve() == Path(source).resolve():
        parser.error(f"--yaml would overwrite the recording {source}")
    return run_command("identify", lambda: _answer(arguments, source))


def _answer(arguments: argparse.Namespace, source: str) -> str:
    """Identify the door, write its file if wanted, and return the text to print."""
    result, geometry = _run(arguments)
    if arguments.json:
        answer = json.dumps(identified(result), indent=2)
    else:
        answer = as_table(
            result, "" if arguments.door else " (the paper door's, since --door is missing)")
    if arguments.yaml is not None:
        config = as_config(result, geometry, restitution=arguments.restitution)
        head = as_comment(result, source)
        if not arguments.door:
            head += "# --door was missing: linkage and frame, and what was not given of the leaf, "
            head += "are those of the paper's door.\n"
        write_whole(arguments.yaml, head + config.to_yaml())
    return answer


if __name__ == "__main__":
    raise SystemExit(main())

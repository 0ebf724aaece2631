"""Command `ros2 run door_model curves`: curves of a closer as table, CSV files and pictures."""

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.files import make_folder, run_command, write_whole

from door_model.checks import require_positive
from door_model.door.config import DoorConfig, load_door
from door_model.door.curves import (
    CloserCurves,
    closer_curves,
    largest_shown,
    round_angles,
    round_step,
)
from door_model.door.door import Door
from door_model.motion.driven_motion import SampledMotion
from door_model.motion.dynamics import follow_free, initial_velocity, simulate
from door_model.motion.energy import EnergyBalance, energy_balance
from door_model.motion.free_motion import End
from door_model.tools.drawing import curves_picture, swing_picture

_DESCRIPTION = """\
Show the curves of a door's closer over the opening angle: those of the paper's Figs. 15 and 16,
the reduction ratio, the damping and the spring's energy."""

_EXAMPLE = """\
columns of the table: angle of the door theta, angle of the closer f, eq. (8), reduction ratio eta,
eq. (9), restoring torque, eq. (12), damping c_c eta^2 of eq. (13) while the door opens and while it
closes, and energy in the spring above that of the closed door.

example, the paper's door and its swing to 25 deg:
  ros2 run door_model curves --swing-deg 25
writes into out/curves:
  curves.csv, curves.png    every half degree; the paper's Figs. 15 and 16, and the damping
  swing.csv, swing.png      every millisecond; angle, velocity, energy stored and dissipated

another door, as identify --yaml wrote it, up to 70 deg:
  ros2 run door_model curves --door my_door.yaml --max-deg 70 --out my_curves
"""

_STEPS = 10  # largest number of steps of the printed table
_STEP = math.radians(0.5)  # step of the curves that are written [rad]


def _parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="curves",
        description=_DESCRIPTION,
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--door",
        default="paper",
        metavar="NAME_OR_YAML",
        help="door of this package, or a YAML file (default: %(default)s)",
    )
    parser.add_argument(
        "--max-deg",
        type=float,
        metavar="DEG",
        help="largest opening angle (default: 90, or one degree below the linkage's end)",
    )
    parser.add_argument(
        "--swing-deg",
        type=float,
        metavar="DEG",
        help="add the free swing from the closed door to this angle, until the door has fallen "
        "shut or friction holds the door open (one minute at most)",
    )
    parser.add_argument(
        "--out",
        default="out/curves",
        metavar="DIR",
        help="folder for the files (default: %(default)s); files of the same name are replaced",
    )
    parser.add_argument(
        "--json", action="store_true", help="print one JSON object with all points of the curves"
    )
    return parser


@dataclass(frozen=True)
class SwingToRest:
    """A swing from the closed door, and its end.

    Attributes:
        swing: The motion.
        end: Reason for the end.
        end_angle: Angle at the end [rad].
    """

    swing: SampledMotion
    end: End
    end_angle: float

    def ending(self) -> str:
        """Return a sentence about the end; empty if the door falls shut."""
        degrees = math.degrees(self.end_angle)
        if self.end == End.STUCK:
            return f"the door stays open at {degrees:.1f} deg"
        if self.end == End.TIME:
            return f"after {self.swing.t[-1]:.0f} s the door still moves, at {degrees:.1f} deg"
        return ""


def free_swing(door: Door, angle: float) -> SwingToRest:
    """Simulate the swing of a closed door to an angle [rad] and back, in samples of 1 ms.

    It ends when the door has fallen shut or friction holds it, or after one minute.

    Raises:
        DoorModelError: The door does not turn round at the angle, as in `initial_velocity`.
    """
    omega = initial_velocity(door, angle)
    motion = follow_free(door, 0.0, omega)
    swing = simulate(door, 0.0, omega, float(motion.end_time[0]), stop=True)
    return SwingToRest(swing, End(motion.end[0]), float(motion.end_angle[0]))


def _swing_columns(swing: SampledMotion, balance: EnergyBalance) -> dict[str, Array]:
    """Return the columns of a swing by name with unit."""
    return {
        "time_s": swing.t,
        "door_deg": np.degrees(swing.theta),
        "velocity_rad_s": swing.omega,
        "kinetic_j": balance.kinetic,
        "spring_j": balance.spring,
        "damper_j": balance.damper,
        "friction_j": balance.friction,
    }


def _csv(columns: Mapping[str, Array]) -> bytes:
    """Return columns as a CSV file."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    return ("\n".join(lines) + "\n").encode()


def _curves(door: Door, max_deg: float | None) -> CloserCurves:
    """Return the curves of a door up to the wanted angle [deg]."""
    end = largest_shown(door.closer)
    if max_deg is not None:
        require_positive("--max-deg", max_deg)
        end = math.radians(max_deg)
        door.closer.require_within(end)
    return closer_curves(door, round_angles(end, _STEP))


def _table(door: Door, end: float) -> str:
    """Return a table of the curves from the closed door to an angle [rad]."""
    heads = ("theta", "f", "eta", "torque", "damping", "(closing)", "spring")
    units = ("[deg]", "[deg]", "[-]", "[N m]", "[N m s]", "[N m s]", "[J]")
    angles = round_angles(end, round_step(end, _STEPS))
    columns = closer_curves(door, angles).columns().values()
    rows = ["".join(f"{value:>10.3f}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join(["".join(f"{word:>10}" for word in words) for words in (heads, units)] + rows)


def _text(
    config: DoorConfig, curves: CloserCurves, found: Mapping[str, Any], ending: str
) -> str:
    """Return the text to print.

    Args:
        config: The door.
        curves: Its curves.
        found: Values that `--json` prints, too.
        ending: Sentence about the end of the swing; may be empty.
    """
    lines = [f"door {config.name!r}, whose linkage opens to {found['opening_limit_deg']:.1f} deg"]
    if found["dead_centre_deg"] is not None:
        lines += [f"dead centre at {found['dead_centre_deg']:.1f} deg"]
    lines += ["", _table(config.door(), float(curves.theta[-1])), ""]
    if "swing" in found:
        swing = found["swing"]
        lines += [
            f"free swing to {swing['peak_deg']:.2f} deg: w' {swing['omega_door']:.4f} rad/s, "
            f"{swing['duration_s']:.2f} s",
            *([ending] if ending else []),
            f"of {swing['kinetic_at_start_j']:.3f} J at the start {swing['kinetic_at_end_j']:.3f} "
            f"are in the leaf at the end, {swing['spring_at_end_j']:z.3f} in the spring,",
            f"{swing['damper_j']:.3f} were turned into heat in the damper, "
            f"{swing['friction_j']:.3f} in the hinge",
            "",
        ]
    return "\n".join([*lines, "written: " + ", ".join(found["files"])])


def _run(arguments: argparse.Namespace) -> str:
    """Work out curves and swing, write the files, and return the text to print."""
    config = load_door(arguments.door)
    door = config.door()
    dead_centre = door.dead_centre()
    curves = _curves(door, arguments.max_deg)
    found: dict[str, Any] = {
        "door": config.name,
        "opening_limit_deg": math.degrees(door.closer.opening_limit()),
        "dead_centre_deg": None if dead_centre is None else math.degrees(dead_centre),
    }
    ending = ""
    files = {
        "curves.csv": _csv(curves.columns()),
        "curves.png": curves_picture(config.name, door, float(curves.theta[-1])),
    }
    if arguments.swing_deg is not None:
        free = free_swing(door, math.radians(arguments.swing_deg))
        swing = free.swing
        balance = energy_balance(door, swing)
        files["swing.csv"] = _csv(_swing_columns(swing, balance))
        files["swing.png"] = swing_picture(config.name, swing, balance, free.ending())
        found["swing"] = {
            "peak_deg": math.degrees(swing.theta.max()),
            "omega_door": float(swing.omega[0]),
            "duration_s": float(swing.t[-1]),
            "kinetic_at_start_j": float(balance.kinetic[0]),
            "kinetic_at_end_j": float(balance.kinetic[-1]),
            "spring_at_end_j": float(balance.spring[-1]),
            "damper_j": float(balance.damper[-1]),
            "friction_j": float(balance.friction[-1]),
            "falls_shut": free.end == End.SHUT,
            "stays_open_deg": math.degrees(free.end_angle) if free.end == End.STUCK else None,
        }
        ending = free.ending()
    folder = make_folder(arguments.out)
    for name, content in files.items():
        write_whole(folder / name, content)
    found["files"] = [str(folder / name) for name in files]
    if arguments.json:
        columns = {name: values.tolist() for name, values in curves.columns().items()}
        return json.dumps({**found, "curves": columns})
    return _text(config, curves, found, ending)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; the exit code is 1 for errors."""
    arguments = _parser().parse_args(argv)
    return run_command("curves", lambda: _run(arguments))


if __name__ == "__main__":
    raise SystemExit(main())

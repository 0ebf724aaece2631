"""Command `ros2 run door_model check_door`: what the file of a door describes."""

import argparse
import math
from collections.abc import Sequence
from dataclasses import fields

from door_impact_common.files import run_command

from door_model.door.config import DoorConfig, door_names, load_door

# Least closing moments of the power sizes 1 to 7 of EN 1154, and the end of the last [N m].
_SIZES = (9.0, 13.0, 18.0, 26.0, 37.0, 54.0, 87.0, 140.0)
_EXAMPLE = """\
example, a door that identify has written; planner and simulation refuse what this command refuses:
  ros2 run door_model check_door my_door.yaml
"""


def closing_size(moment: float) -> str:
    """Return the power size of EN 1154 for a moment at the closed door [N m], in words."""
    size = sum(round(moment, 2) >= least for least in _SIZES)
    return f"size {size}" if 0 < size < len(_SIZES) else "no size"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command, and return its exit code: 1 for a door that is refused."""
    parser = argparse.ArgumentParser(
        prog="check_door", epilog=_EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Print what the file of a door describes, and what is improbable in it.")
    parser.add_argument(
        "door", metavar="NAME_OR_YAML", help=f"{', '.join(door_names())}, or a YAML file")
    door = parser.parse_args(argv).door
    return run_command("check_door", lambda: _text(load_door(door)))


def _text(config: DoorConfig) -> str:
    leaf, link, door = config.leaf, config.linkage, config.door()
    limit = link.opening_limit()
    torques = [f"{float(door.restoring_torque(math.radians(angle))):.2f} N m at {angle} deg"
               for angle in (0, 10, 25) if math.radians(angle) < limit]
    zones = [f"{name} {zone.c_c:g} N m s/rad {where} {math.degrees(zone.angle):.1f} deg"
             for name, zone, where in (("backcheck", config.backcheck, "beyond"),
                                       ("latch", config.latch, "below")) if zone is not None]
    links = ", ".join(f"{field.name} {getattr(link, field.name):g}" for field in fields(link))
    return "\n".join([
        f"{config.name}: leaf {leaf.mass:g} kg, {leaf.width:g} m wide, upper edge {leaf.top:g} m "
        f"above the floor, {leaf.thickness:g} m thick; I_A {config.i_a:.2f} kg m^2",
        f"linkage: {links} [m, rad]; opens to {math.degrees(limit):.1f} deg",
        f"closer: k_c {config.k_c:g} N m/rad, tau'_c0 {config.tau_c0_prime:g} N m, c_c "
        f"{config.c_c:g} N m s/rad opening and {door.closing_viscosity:g} closing"
        + "".join(f", {zone}" for zone in zones)
        + f"; friction at the hinge {config.friction:g} N m",
        f"torque: {', '.join(torques)}; {closing_size(float(door.restoring_torque(0.0)))} of "
        "EN 1154",
        *(f"doubt: {doubt}" for doubt in config.doubts() or ("none",)),
    ])


if __name__ == "__main__":
    raise SystemExit(main())

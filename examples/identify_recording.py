"""Identify a door from a recording of its hinge encoder, without ROS.

`make setup`, then `.venv/bin/python examples/identify_recording.py --help`.
"""

import argparse
from math import degrees

from door_model.data import data_path
from door_model.door.config import load_geometry
from door_model.identification.identify import identify
from door_model.identification.scale import scale_from_leaf
from door_model.recording.recording import read_csv

UNITS = {"i_a": "kg m^2", "c_c": "N m s/rad", "k_c": "N m/rad", "tau_c0_prime": "N m",
         "c_c_closing": "N m s/rad"}


def main(args: list[str] | None = None) -> None:
    """Print each parameter of the door with its standard deviation."""
    parser = argparse.ArgumentParser(
        description="Identify a door from five pushes by hand.")
    parser.add_argument("--csv", help="recording with the header time_s,count (default: the "
                        "recording of a simulated door that comes with the package door_model)")
    parser.add_argument("--door", default="paper", help="name or YAML file of a door with this "
                        "leaf and this closer linkage (default: %(default)s)")
    options = parser.parse_args(args)

    recording = read_csv(options.csv or data_path("recordings") / "paper_five_swings.csv")
    geometry = load_geometry(options.door)
    # Free swings fix only the ratios of the parameters; mass and width of the leaf fix the scale.
    scale = scale_from_leaf(geometry.leaf.mass, geometry.leaf.width)
    found = identify(recording, geometry.linkage, scale)

    for name, value in zip(found.names, found.values, strict=True):
        print(f"{name:12s} {value:8.4f} +- {found.std_of(name):.4f} {UNITS.get(name, '')}")
    print(f"residual     {degrees(found.fit_rmse):8.4f} deg rms over {len(found.swings)} swings")
    for warning in found.warnings:
        print(f"warning: {warning}")


if __name__ == "__main__":
    main()

"""Say of doors whether HRP-2 hits them or pushes them open from closed, and why, without ROS.

`make setup`, then `.venv/bin/python examples/push_or_hit.py light paper`.
"""

import argparse

import numpy as np
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config, needed
from humanoid_motion.robot_model import RobotModel
from walking.errors import PLANNING_ERRORS
from walking.footsteps.footstep import ORIGIN, Stance
from walking.passing.doorway import Doorway
from walking.passing.opening import PUSH, choose_opening


def main(args: list[str] | None = None) -> None:
    """Print for each door what is chosen, and what is said of a push that somebody wants."""
    parser = argparse.ArgumentParser(description="Push or hit?")
    parser.add_argument("doors", nargs="+", help="names or YAML files of doors with a frame")
    parser.add_argument("--door-distance", type=float, default=0.715,
                        help="distance of the closed leaf's face [m] (default: %(default)s)")
    parser.add_argument("--hinge-x", type=float, default=-0.4056,
                        help="x of the hinge [m] (default: %(default)s)")
    options = parser.parse_args(args)

    robot = RobotModel(load_robot_config())
    soles = Stance.around(ORIGIN, needed(robot.config.footsteps, "footsteps").width)
    hinge = np.array([options.hinge_x, -options.door_distance])
    for name in options.doors:
        config = load_door(name)
        doorway = Doorway(hinge, config.leaf, needed(config.frame, "frame"))
        for wanted in ("", PUSH):
            try:
                said = choose_opening(robot, config.door(), doorway, soles, wanted).reason
            except PLANNING_ERRORS as error:
                said = f"refused: {error}"
            print(f"| `{config.name}` | {wanted or '(empty)'} | {said} |")


if __name__ == "__main__":
    main()

"""Print which angles can be planned, by door, restitution and run-up: the table of docs/planner.md.

Run it with `.venv/bin/python docs/figures/largest_angles.py [DOOR ...]`; it takes ten minutes.
"""

import math
import sys

from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.errors import PLANNING_ERRORS
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import RUN_UPS

DOORS = ("paper", "size2", "size3", "size4")
RESTITUTIONS = (0.3, 0.5, 0.7)
ANGLES = range(10, 61, 2)  # [deg]


def planned(robot: RobotModel, door: KnownDoor, restitution: float, run_up: str) -> list[int]:
    """Return the opening angles [deg] that can be planned."""
    found = []
    for angle in ANGLES:
        request = PlanRequest(math.radians(angle), restitution=restitution, run_up=run_up)
        try:
            plan_impact(request, door, robot)
        except PLANNING_ERRORS:
            continue
        found.append(angle)
    return found


def main(names: list[str]) -> None:
    """Print a row for each door and run-up."""
    robot = RobotModel(load_robot_config())
    print("| door, run-up | " + " | ".join(f"e = {e}" for e in RESTITUTIONS) + " |")
    print("| --- |" + " --- |" * len(RESTITUTIONS))
    for name in names or DOORS:
        door = KnownDoor.configured(load_door(name))
        for run_up in RUN_UPS:
            row = f"| {name}, {run_up} |"
            for restitution in RESTITUTIONS:
                found = planned(robot, door, restitution, run_up)
                row += f" {min(found)} to {max(found)} |" if found else " none |"
            print(row, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

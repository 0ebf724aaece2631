"""Draw docs/robot_and_door.png: HRP-2 at the hit, from the front and from above.

Everything is taken from the plan for the paper's door and 25 deg. Run it with
`.venv/bin/python docs/robot_and_door.py`.
"""

import argparse
import math
from pathlib import Path

from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.tools.plotting import draw_above, draw_front
from matplotlib.figure import Figure


def main(args: list[str] | None = None) -> None:
    """Plan the hit and draw both views into one picture."""
    parser = argparse.ArgumentParser(description="Draw robot and door at the hit.")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".png"))
    out = parser.parse_args(args).out
    robot = RobotModel(load_robot_config())
    request, known = PlanRequest(math.radians(25.0)), KnownDoor.configured(load_door("paper"))
    plan = plan_impact(request, known, robot)
    figure = Figure(figsize=(10.0, 4.9), layout="constrained")
    front, above = figure.subplots(1, 2, width_ratios=[1.0, 1.12])
    draw_front(front, plan, robot)
    draw_above(above, plan, robot)
    figure.savefig(out, dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()

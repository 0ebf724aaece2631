"""Plan a hit that opens a door to an angle, without ROS.

`make setup`, then `.venv/bin/python examples/plan_hit.py --help`.
"""

import argparse
from math import radians

from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest


def main(args: list[str] | None = None) -> None:
    """Print the speeds of door and robot, and the ZMP margin of each phase."""
    parser = argparse.ArgumentParser(description="Plan a hit with HRP-2.")
    parser.add_argument("--angle-deg", type=float, default=25.0,
                        help="desired opening angle [deg] (default: %(default)s)")
    parser.add_argument("--door", default="paper",
                        help="name or YAML file of the door (default: %(default)s)")
    options = parser.parse_args(args)

    # The planner takes the parameters in the file as the door's exact ones. The restitution that
    # it plans with is a setting of its own, 0.5 unless the request has another.
    door = KnownDoor.configured(load_door(options.door))
    robot = RobotModel(load_robot_config())
    plan = plan_impact(PlanRequest(desired_opening_angle=radians(options.angle_deg)), door, robot)

    print(f"w'    {plan.omega_door:.3f} rad/s  angular velocity of the door after the hit")
    print(f"v_rB  {plan.v_rb:.3f} m/s    speed of the elbow (point B) before the hit")
    print(f"v'_rB {plan.v_rb_post:.3f} m/s    speed of the elbow after the hit")
    print(f"m_re  {plan.effective_mass:.1f} kg      effective mass of the robot at B")
    for phase in plan.phases:
        print(f"{phase.name:8s} ZMP margin {1e3 * phase.margin:4.0f} mm")
    for warning in plan.warnings:
        print(f"warning: {warning}")


if __name__ == "__main__":
    main()

"""Plan a hit and run it in the simulated world, without ROS. It takes half a minute.

`make setup`, then `.venv/bin/python examples/hit_in_simulation.py --help`.
"""

import argparse
from math import degrees
from pathlib import Path

from door_impact_evaluation.run.rehearsal import rehearse
from hrp2_sim_bridge.settings import ENGINES, WorldSettings


def main(args: list[str] | None = None) -> None:
    """Print what was planned beside what the simulation measured."""
    parser = argparse.ArgumentParser(description="Hit a door in the simulation.")
    parser.add_argument("--angle-deg", type=float, default=25.0,
                        help="desired opening angle [deg] (default: %(default)s)")
    parser.add_argument("--door", default="paper",
                        help="name or YAML file of the door (default: %(default)s)")
    parser.add_argument("--log", type=Path, default=Path("out/hit.npz"),
                        help="where the log of the simulation is written (default: %(default)s)")
    parser.add_argument("--engine", choices=ENGINES, default=WorldSettings.engine,
                        help="physics engine (default: %(default)s)")
    options = parser.parse_args(args)

    options.log.parent.mkdir(parents=True, exist_ok=True)
    run = rehearse(options.angle_deg, options.log, door=options.door, engine=options.engine)

    if run.impact is None:
        raise SystemExit("The robot did not touch the door.")
    peak = degrees(run.log.motion.door_angle[run.impact.peak])
    print(f"largest opening angle   {peak:.2f} deg, desired {options.angle_deg:.2f} deg")
    print(f"v_rB before the hit     {run.impact.v_rb:.3f} m/s, planned {run.plan.v_rb:.3f} m/s")
    print(f"w' after the hit        {run.impact.omega_door:.3f} rad/s, "
          f"planned {run.plan.omega_door:.3f} rad/s")
    print(f"largest contact force   {run.impact.peak_force:.0f} N, "
          f"{1e3 * run.impact.duration:.0f} ms of contact")
    print(f"the robot {'fell: ' + run.log.fell if run.log.fell else 'stands'}")


if __name__ == "__main__":
    main()

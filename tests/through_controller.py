"""Run sweeps with the rules of ros2_control's controller instead of those of our own driver.

`python tests/through_controller.py hit -n 10 --seed 3 --engine mujoco`: the simulated joints follow
`ControllerDouble`. With `--shadow` they follow the driver, and the largest difference between the
two references is printed.
"""

import argparse
import os
import sys
from pathlib import Path

import numpy as np
from controller_double import PERIOD, ControllerDouble
from door_impact_evaluation.sweep.report import summary, table
from door_impact_evaluation.sweep.sweep import KINDS
from hrp2_sim_bridge import world
from robot_driver.trajectory_driver import TrajectoryDriver

MADE: list[ControllerDouble] = []


class Counted(ControllerDouble):
    """A double that says afterwards what it was sent."""

    def __init__(self, *args: object) -> None:
        super().__init__(*args)  # type: ignore[arg-type]
        MADE.append(self)


class Shadowed(TrajectoryDriver):
    """The driver, which a double follows."""

    farthest = 0.0  # largest difference of the references [rad]

    def __init__(self, limits, position):
        self.double = Counted(limits, position)
        super().__init__(limits, position)

    def reset(self, position, now=0.0):
        super().reset(position, now)
        self.double.reset(position, now)

    def accept(self, message, stamp, now):
        super().accept(message, stamp, now)
        self.double.accept(message, stamp, now)

    def stop(self, now):
        super().stop(now)
        self.double.stop(now)

    def positions(self, times):
        found = super().positions(times)
        off = np.abs(self.double.positions(times)[-1] - found[-1]).max()
        Shadowed.farthest = max(Shadowed.farthest, off)
        return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=sorted(KINDS))
    parser.add_argument("-n", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--engine", default="mujoco")
    parser.add_argument("--group", default="", help="only cases of this group")
    parser.add_argument("--shadow", action="store_true")
    given = parser.parse_args()
    world.TrajectoryDriver = Shadowed if given.shadow else Counted
    kind, rows = KINDS[given.kind], []
    for case in kind.draw(given.n, given.seed):
        if given.group in ("", str(case.get("group"))):
            for number, found in enumerate(kind.run(case | {"engine": given.engine})):
                rows.append({**case, "run": number, "refused": None, "error": None, **found})
                print(found, flush=True)
    limits = MADE[0].limits.velocity * PERIOD
    print(table(kind, summary(kind, rows, given.n, given.seed, given.engine)))
    print("rejected:", [each.rejected for each in MADE if each.rejected])
    fastest = max((each.steps / limits).max() for each in MADE)
    print(f"largest step of a command: {fastest:.3f} of its limit")
    if given.shadow:
        print(f"largest difference: {1e3 * Shadowed.farthest:.4f} mrad")
    return 0


if __name__ == "__main__":
    os.chdir(Path(__file__).resolve().parents[1])
    sys.exit(main())

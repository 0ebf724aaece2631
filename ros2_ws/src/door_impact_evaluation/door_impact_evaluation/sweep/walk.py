"""Kind ``walk``: walks from anywhere, on floors and rubber that the plan does not know."""

import math
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_impact_view.replay.recording import Replay
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.errors import SimBridgeError
from humanoid_motion.robot_model import RobotModel
from walking.footsteps.footstep import Pose

from door_impact_evaluation.run.walk_run import Walked, plan_between, walk
from door_impact_evaluation.sweep.kind import BadRun, Kind, Record, bad_runs, replay_lines
from door_impact_evaluation.sweep.numbers import largest, shown, smallest, smallness
from door_impact_evaluation.sweep.walk_measures import falls_and_margins, walk_record, worst_line

GOALS = {"ahead": (5.0, 0.0, 0.0), "sideways": (0.0, 2.0, 0.0), "turn": (0.0, 0.0, 360.0)}
"""Goal of each group: ahead [m], left [m] and turn [deg]; every second one is to the right."""
FRICTION = (0.4, 1.0)  # range of the friction coefficient of the soles
RUBBER = (0.7, 1.3)    # range of the factor of the rubber's stiffness
FARTHEST = 10.0        # largest distance of the start from the origin of odom [m]
OFF_SHARE, OFF_TURN = 0.02, 50.0  # largest error of the end: share of the way; of a turn [mm]
OFF_YAW = 3.0          # largest error of the heading at the end [deg]
TILT = 5.0             # largest tilt [deg]
SPEED_SHARE = 0.9      # largest share of a joint's speed limit
MARGIN = 15.0          # ZMP margin that 95 % of the runs keep [mm]
ENDS = 2               # runs with a replay because of their end


@dataclass(frozen=True)
class WalkCase:
    """A walk and its perturbations, which neither plan nor stabilizer knows.

    Attributes:
        group: Name of the goal in `GOALS`.
        index: Number of the case, from 0.
        goal: Goal as seen from the start: ahead [m], left [m] and turn [rad].
        start: Pose of the middle between the soles at the start in odom: x [m], y [m], yaw [rad].
        friction: Friction coefficient of the soles.
        rubber_scale: Factor of the stiffness of the soles' rubber.
        seed: Seed of the sensors' noise.
    """

    group: str
    index: int
    goal: tuple[float, float, float]
    start: tuple[float, float, float]
    friction: float
    rubber_scale: float
    seed: int

    @property
    def name(self) -> str:
        """Name of the case, unique within a sweep."""
        return f"{self.group}-{self.index}"

    def as_json(self) -> dict[str, Any]:
        """Returns the case as it is written to a record."""
        return asdict(self) | {"goal": list(self.goal), "start": list(self.start)}


def walk_cases(n: int, seed: int) -> list[WalkCase]:
    """Draws the cases; goals take turns.

    Args:
        n: Number of cases.
        seed: Seed of the random numbers.
    """
    return [_drawn(index, seed) for index in range(n)]


def _drawn(index: int, seed: int) -> WalkCase:
    random = np.random.default_rng([seed, index])
    group = list(GOALS)[index % len(GOALS)]
    ahead, left, turn = GOALS[group]
    side = (-1.0) ** (index // len(GOALS))
    # Uniform over the area: the root of a uniform share of the largest distance.
    away, bearing = FARTHEST * math.sqrt(random.uniform()), random.uniform(-math.pi, math.pi)
    return WalkCase(
        group, index, (ahead, side * left, side * math.radians(turn)),
        (away * math.cos(bearing), away * math.sin(bearing),
         float(random.uniform(-math.pi, math.pi))),
        friction=float(random.uniform(*FRICTION)), rubber_scale=float(random.uniform(*RUBBER)),
        seed=int(random.integers(1 << 30)))


class Walk(Kind):
    """Walks 5 m ahead, 2 m sideways and around by 360 deg."""

    name = "walk"
    unit = "walk"
    part = "walk"
    what = "walks ahead, sideways and around, and reports where they ended"

    def cases(self, n: int, seed: int) -> list[WalkCase]:
        """Draws the cases; see `walk_cases`."""
        return walk_cases(n, seed)

    def run(self, case: WalkCase, engine: str) -> list[Record]:
        """Simulates a walk; a plan that was refused is recorded as such."""
        record: Record = {"name": case.name, "walk": 0, "case": case.as_json()}
        try:
            return [record | walk_record(_walked(case, engine))]
        except SimBridgeError:  # no refusal of the plan, and no result
            raise
        except DoorImpactError as error:
            return [record | {"stood": False, "refused": str(error)}]

    def numbers(self, records: list[Record]) -> dict[str, Any]:
        """Computes the figures, and how many walks kept every limit of their end."""
        return {
            "stood": sum(r["stood"] for r in records),
            "min_margin_mm": smallest(r.get("margin_mm") for r in records),
            "arrived": sum(_arrived(r) for r in records),
            "refused": sum("refused" in r for r in records),
            "walks": {group: _of_group([r for r in records if r["case"]["group"] == group])
                      for group in GOALS},
        }

    def worst(self, records: list[Record]) -> list[BadRun]:
        """Chooses falls, the ends farthest off, and the smallest margins."""
        ended = [r for r in records if r["stood"]]
        far = [(r, f"ended {shown(r['off_mm'])} mm off, {shown(100.0 * _off_share(r))} % of what "
                "is allowed") for r in sorted(ended, key=lambda r: smallness(_off_share(r)))]
        return bad_runs(self, falls_and_margins(records) + far[:ENDS])

    def table(self, found: dict[str, Any]) -> str:
        """Formats the results as a table for a terminal."""
        lines = [f"{found['n']} walks, seed {found['seed']}, engine {found['engine']}",
                 f"  stood {found['stood']}, arrived {found['arrived']} (within 2 % of the way, a "
                 f"turn within {OFF_TURN:g} mm, and {OFF_YAW:g} deg), refused {found['refused']}",
                 f"  smallest ZMP margin {shown(found['min_margin_mm']['min'], '.1f')} mm, "
                 f"5 % below {shown(found['min_margin_mm']['p5'], '.1f')} mm", "",
                 f"{'':10}{'stood':>10}{'end off [mm]':>15}{'yaw off [deg]':>15}{'tilt [deg]':>12}"
                 f"{'joint speed':>13}   (largest; 5 % above)"]
        for group, row in found["walks"].items():
            lines.append(f"  {group:8}{row['stood']:>4} of {row['n']:<3}" + "".join(
                f"{shown(row[key]['max'], form):>{width - 6}}; {shown(row[key]['p95'], form):<4}"
                for key, form, width in (("off_mm", ".0f", 13), ("yaw_deg", ".1f", 15),
                                         ("tilt_deg", ".1f", 13), ("speed_share", ".2f", 13))))
        lost = [worst_line(r) for r in found["runs"] if not r["stood"]]
        return "\n".join([*lines, *([""] + lost if lost else []), *replay_lines(found)])

    def figure(self, found: dict[str, Any], path: Path) -> None:
        """Draws ends, margins and tilts over the perturbations."""
        from door_impact_evaluation.sweep.drawing import Panel, draw

        friction, rubber = "friction of the soles", "factor of the rubber's stiffness"
        off = "end off / what is allowed"
        panels = [
            Panel(friction, off, lambda r: r["case"]["friction"], _off_share, (1.0,)),
            Panel(rubber, off, lambda r: r["case"]["rubber_scale"], _off_share, (1.0,)),
            Panel(friction, "smallest ZMP margin [mm]", lambda r: r["case"]["friction"],
                  lambda r: r["margin_mm"], (0.0, MARGIN)),
            Panel(rubber, "smallest ZMP margin [mm]", lambda r: r["case"]["rubber_scale"],
                  lambda r: r["margin_mm"], (0.0, MARGIN)),
            Panel("start from the origin [m]", "heading off at the end [deg]",
                  lambda r: math.hypot(*r["case"]["start"][:2]), _yaw, (-OFF_YAW, OFF_YAW)),
            Panel(rubber, "largest tilt [deg]", lambda r: r["case"]["rubber_scale"],
                  lambda r: r["tilt_deg"], (TILT,)),
        ]
        draw(panels, {group: [r for r in found["runs"] if r["case"]["group"] == group]
                      for group in GOALS}, path)

    def replay(self, case: WalkCase, engine: str, number: int) -> Replay:
        """Simulates a walk again, and makes its replay."""
        from door_impact_evaluation.report.walk_replay import replay_of_walk

        return replay_of_walk(_walked(case, engine), load_robot_config())


def _walked(case: WalkCase, engine: str) -> Walked:
    robot, start = walker(), Pose(*case.start)
    plan = plan_between(robot, start, start.moved(*case.goal), keep_heading=True, whole_turns=True)
    return walk(robot, plan, engine=engine, friction=case.friction,
                rubber_scale=case.rubber_scale, seed=case.seed)


@lru_cache(maxsize=1)
def walker() -> RobotModel:
    """Returns the model of the robot, which each process makes once."""
    return RobotModel(load_robot_config())


def _off_share(record: Record) -> float:
    """Returns the error of the place at the end over what is allowed; NaN if it is not known."""
    off, goal = record["off_mm"], record["case"]["goal"]
    way = math.hypot(*goal[:2])
    return math.nan if off is None else off / (1e3 * OFF_SHARE * way if way else OFF_TURN)


def _yaw(record: Record) -> float | None:
    return record["end"] and record["end"]["yaw_deg"]


def _arrived(record: Record) -> bool:
    """Returns whether the robot stood at its goal in the end."""
    yaw = _yaw(record) if record["stood"] else None
    return yaw is not None and _off_share(record) <= 1.0 and abs(yaw) <= OFF_YAW


def _of_group(records: list[Record]) -> dict[str, Any]:
    done = [r for r in records if "refused" not in r]
    return {
        "n": len(records), "stood": sum(r["stood"] for r in records),
        "arrived": sum(_arrived(r) for r in records),
        "off_mm": largest(r["off_mm"] for r in done), "yaw_deg": largest(map(_yaw, done)),
        "tilt_deg": largest(r["tilt_deg"] for r in done),
        "speed_share": largest(r["speed_share"] for r in done),
        "min_margin_mm": smallest(r["margin_mm"] for r in done),
    }

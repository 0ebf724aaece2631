"""Kind ``push``: blows at the center of mass in mid single support of a walk."""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_view.replay.recording import Replay
from hrp2_description.robot import load_robot_config
from walking.footsteps.footstep import Pose
from walking.pattern.walk_plan import WalkPlan

from door_impact_evaluation.run.walk_run import PUSH_DURATION, Push, Walked, plan_between, walk
from door_impact_evaluation.sweep.kind import BadRun, Kind, Record, bad_runs, replay_lines
from door_impact_evaluation.sweep.numbers import largest, shown, smallest
from door_impact_evaluation.sweep.walk import walker
from door_impact_evaluation.sweep.walk_measures import falls_and_margins, walk_record, worst_line

GOALS = {"ahead": (1.2, 0.0), "sideways": (0.0, 0.6)}
"""Goal of each group: ahead and left [m]; every second walk sideways is to the right."""


@dataclass(frozen=True)
class Blow:
    """A blow that each case gets, in a walk of its own.

    Attributes:
        name: Its name.
        impulse: Its size [N s].
        step_change: Whether the robot may put its feet elsewhere after it.
    """

    name: str
    impulse: float
    step_change: bool


BLOWS = (Blow("fore and aft", 20.0, step_change=False),
         Blow("sideways", 16.0, step_change=False),
         Blow("any direction", 25.0, step_change=True))


@dataclass(frozen=True)
class PushCase:
    """A walk, the step in which it is disturbed, and the directions of the blows.

    Attributes:
        group: Name of the goal in `GOALS`.
        index: Number of the case, from 0.
        goal: Goal as seen from the start: ahead and left [m].
        place: Which of the walk's steps, as a share from 0 to 1.
        directions: Direction of each of `BLOWS` as seen by the robot, 0 is ahead and a quarter turn
            is to the left [rad].
        seed: Seed of the sensors' noise.
    """

    group: str
    index: int
    goal: tuple[float, float]
    place: float
    directions: tuple[float, ...]
    seed: int

    @property
    def name(self) -> str:
        """Name of the case, unique within a sweep."""
        return f"{self.group}-{self.index}"

    def as_json(self) -> dict[str, Any]:
        """Returns the case as it is written to a record."""
        return asdict(self) | {"goal": list(self.goal), "directions": list(self.directions)}


def push_cases(n: int, seed: int) -> list[PushCase]:
    """Draws the cases; goals take turns.

    Args:
        n: Number of cases.
        seed: Seed of the random numbers.
    """
    return [_drawn(index, seed) for index in range(n)]


def _drawn(index: int, seed: int) -> PushCase:
    random = np.random.default_rng([seed, index])
    group = list(GOALS)[index % len(GOALS)]
    ahead, left = GOALS[group]
    place = float(random.uniform())
    fore = math.pi * float(random.integers(2))
    side = math.pi * (float(random.integers(2)) - 0.5)
    return PushCase(
        group, index, (ahead, (-1.0) ** (index // len(GOALS)) * left), place,
        (fore, side, float(random.uniform(-math.pi, math.pi))), seed=int(random.integers(1 << 30)))


def push_of(case: PushCase, plan: WalkPlan, number: int) -> tuple[Push, str]:
    """Returns a blow of a case, and the foot that swings then.

    Args:
        case: The case.
        plan: Its walk, which keeps its heading.
        number: Number of the blow in `BLOWS`.
    """
    step = int(case.place * len(plan.footsteps))
    phase = next(phase for phase in plan.schedule.phases
                 if phase.kind == "single" and phase.step == step)
    middle = 0.5 * (phase.first + phase.last) * plan.schedule.period
    direction = phase.stance.middle.yaw + case.directions[number]
    size = BLOWS[number].impulse
    return Push(middle - 0.5 * PUSH_DURATION,
                (size * math.cos(direction), size * math.sin(direction), 0.0)), phase.swing


class PushKind(Kind):
    """Walks ahead and sideways that are each disturbed by `BLOWS`, one in each run."""

    name = "push"
    unit = "walk"
    part = "blow"
    what = "pushes the walking robot, and reports whether it stood"

    def cases(self, n: int, seed: int) -> list[PushCase]:
        """Draws the cases; see `push_cases`."""
        return push_cases(n, seed)

    def run(self, case: PushCase, engine: str) -> list[Record]:
        """Simulates one walk for each blow."""
        records: list[Record] = []
        for number, blow in enumerate(BLOWS):
            walked, swing = _pushed(case, engine, number)
            push = walked.pushes[0]
            records.append({
                "name": case.name, "blow": number, "case": case.as_json(), "kind": blow.name,
                "impulse": blow.impulse, "step_change": blow.step_change, "at_s": push.at_s,
                "swing": swing, "outward": _outward(case.directions[number], swing),
                **walk_record(walked)})
        return records

    def numbers(self, records: list[Record]) -> dict[str, Any]:
        """Computes the figures; "stood" counts the cases that stood after every blow."""
        fell = {r["name"] for r in records if not r["stood"]}
        return {
            "stood": len({r["name"] for r in records} - fell),
            "min_margin_mm": smallest(r["margin_mm"] for r in records),
            "blows": {blow.name: _of_blow(
                blow, [r for r in records if r["kind"] == blow.name]) for blow in BLOWS},
        }

    def worst(self, records: list[Record]) -> list[BadRun]:
        """Chooses falls, the weakest blows first, and the smallest margins."""
        found = falls_and_margins(sorted(records, key=lambda r: r["impulse"]))
        return bad_runs(self, [(r, f"{r['kind']}, {r['impulse']:g} N s, {why}")
                               for r, why in found])

    def table(self, found: dict[str, Any]) -> str:
        """Formats the results as a table for a terminal."""
        lines = [f"{found['n']} walks, seed {found['seed']}, engine {found['engine']}; blows of "
                 f"{PUSH_DURATION:g} s in the middle of a single support",
                 f"  stood after every blow {found['stood']} of {found['n']}", "",
                 f"{'':16}{'impulse':>9}{'steps changed':>15}{'stood':>11}{'tilt [deg]':>13}"
                 f"{'ZMP margin [mm]':>19}   (of those that stood: largest; smallest)"]
        for name, row in found["blows"].items():
            changed = row["changed"] if row["step_change"] else "not allowed"
            lines.append(
                f"  {name:14}{row['impulse']:5g} N s{changed:>15}{row['stood']:>5} of {row['n']:<3}"
                f"{shown(row['tilt_deg']['max'], '.1f'):>12}"
                f"{shown(row['min_margin_mm']['min'], '.1f'):>19}")
        lost = [f"{worst_line(r)} after {r['impulse']:g} N s {r['kind']}, "
                f"{math.degrees(r['case']['directions'][r['blow']]):.0f} deg, while the "
                f"{r['swing']} foot swung" for r in found["runs"] if not r["stood"]]
        return "\n".join([*lines, *([""] + lost if lost else []), *replay_lines(found)])

    def figure(self, found: dict[str, Any], path: Path) -> None:
        """Draws tilts and margins over direction and place of the blows."""
        from door_impact_evaluation.sweep.drawing import Panel, draw

        def outward(record: Record) -> float:
            return float(record["outward"])

        def direction(record: Record) -> float:
            return math.degrees(record["case"]["directions"][record["blow"]])

        over = "direction [deg], 0 ahead, 90 left"
        out = "share towards the swinging foot"
        panels = [
            Panel(over, "largest tilt [deg]", direction, lambda r: r["tilt_deg"]),
            Panel(out, "largest tilt [deg]", outward, lambda r: r["tilt_deg"]),
            Panel(over, "smallest ZMP margin [mm]", direction, lambda r: r["margin_mm"], (0.0,)),
            Panel(out, "smallest ZMP margin [mm]", outward, lambda r: r["margin_mm"], (0.0,)),
        ]
        draw(panels, {blow.name: [r for r in found["runs"] if r["kind"] == blow.name]
                      for blow in BLOWS}, path)

    def replay(self, case: PushCase, engine: str, number: int) -> Replay:
        """Simulates a blow again, and makes its replay."""
        from door_impact_evaluation.report.walk_replay import replay_of_walk

        return replay_of_walk(_pushed(case, engine, number)[0], load_robot_config())


def _pushed(case: PushCase, engine: str, number: int) -> tuple[Walked, str]:
    robot, start = walker(), Pose(0.0, 0.0, 0.0)
    plan = plan_between(robot, start, start.moved(*case.goal), keep_heading=True)
    push, swing = push_of(case, plan, number)
    walked = walk(robot, plan, [push], step_change=BLOWS[number].step_change, engine=engine,
                  seed=case.seed)
    return walked, swing


def _outward(direction: float, swing: str) -> float:
    """Returns which share of a blow points to the side of the swinging foot, from -1 to 1."""
    return math.sin(direction) * (1.0 if swing == "left" else -1.0)


def _of_blow(blow: Blow, records: list[Record]) -> dict[str, Any]:
    stood = [r for r in records if r["stood"]]
    return {
        "impulse": blow.impulse, "step_change": blow.step_change,
        "n": len(records), "stood": len(stood),
        "changed": sum(r["changed_steps"] > 0 for r in records),
        "tilt_deg": largest(r["tilt_deg"] for r in stood),
        "min_margin_mm": smallest(r["margin_mm"] for r in stood),
    }

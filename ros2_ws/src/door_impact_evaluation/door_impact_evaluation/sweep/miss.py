"""Kind ``miss``: hits whose door is not there, by run-ups up to the fastest ones."""

import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_impact_view.replay.recording import Replay
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.errors import SimBridgeError

from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from door_impact_evaluation.sweep.hit_runs import UPRIGHT
from door_impact_evaluation.sweep.kind import BadRun, Kind, Record, bad_runs, replay_lines
from door_impact_evaluation.sweep.numbers import goodness, known, shown, smallest
from door_impact_evaluation.sweep.walk_measures import falls_and_margins, worst_line

AWAY = 6.0              # distance by which the door stands farther away than it was surveyed [m]
TARGETS = (10.0, 30.0)  # range of the desired opening angles [deg]
FRICTION = (0.5, 1.0)   # range of the friction coefficient of the soles
GROUPS = {"paper": (("paper",), "mcv50"), "fast": (("size2", "size3"), "zmp_limited")}
"""Doors and run-up of each group: the paper's, and the hits that need the fastest run-ups."""


@dataclass(frozen=True)
class MissCase:
    """A hit on a door that is not there.

    Attributes:
        group: Name of the group in `GROUPS`.
        index: Number of the case within its group, from 0.
        door: Name of the door for which the hit is planned.
        run_up: Profile of the run-up.
        target_deg: Desired opening angle [deg].
        friction: Friction coefficient of the soles.
        seed: Seed of the sensors' noise.
    """

    group: str
    index: int
    door: str
    run_up: str
    target_deg: float
    friction: float
    seed: int

    @property
    def name(self) -> str:
        """Name of the case, unique within a sweep."""
        return f"{self.group}-{self.index}"

    def as_json(self) -> dict[str, Any]:
        """Returns the case as it is written to a record."""
        return asdict(self)


def miss_cases(n: int, seed: int) -> list[MissCase]:
    """Draws the cases.

    Args:
        n: Number of cases in each group.
        seed: Seed of the random numbers.
    """
    return [_drawn(number, group, index, seed)
            for number, group in enumerate(GROUPS) for index in range(n)]


def _drawn(number: int, group: str, index: int, seed: int) -> MissCase:
    random = np.random.default_rng([seed, index, number])
    doors, run_up = GROUPS[group]
    return MissCase(
        group, index, doors[index % len(doors)], run_up,
        target_deg=float(random.uniform(*TARGETS)), friction=float(random.uniform(*FRICTION)),
        seed=int(random.integers(1 << 30)))


class Miss(Kind):
    """Hits on doors that are not there: of the paper's door, and by faster run-ups."""

    name = "miss"
    unit = "miss"
    part = "miss"
    what = "hits where there is no door, and reports whether the robot stood or was to fall"

    def cases(self, n: int, seed: int) -> list[MissCase]:
        """Draws the cases; see `miss_cases`."""
        return miss_cases(n, seed)

    def run(self, case: MissCase, engine: str) -> list[Record]:
        """Simulates a missed hit; a plan that was refused is recorded as such."""
        record: Record = {"name": case.name, "miss": 0, "case": case.as_json()}
        try:
            return [record | _measured(_missed(case, engine))]
        except SimBridgeError:  # no refusal of the planner, and no result
            raise
        except DoorImpactError as error:
            return [record | {"stood": False, "refused": str(error)}]

    def numbers(self, records: list[Record]) -> dict[str, Any]:
        """Computes the figures; "stood" and "min_margin_mm" are those of the paper's door."""
        groups = {group: [r for r in records if r["case"]["group"] == group] for group in GROUPS}
        return {
            "stood": sum(r["stood"] for r in groups["paper"]),
            "min_margin_mm": smallest(
                r["margin_mm"] for r in groups["paper"] if "refused" not in r),
            **{group: _of_group(rows) for group, rows in groups.items()},
        }

    def worst(self, records: list[Record]) -> list[BadRun]:
        """Chooses falls, first those that no plan announced, and the smallest margins."""
        done = sorted((r for r in records if "refused" not in r), key=lambda r: r["announced"])
        return bad_runs(self, [
            (r, why if r["stood"] or r["announced"] else f"{why}, which the plan did not announce")
            for r, why in falls_and_margins(done)])

    def table(self, found: dict[str, Any]) -> str:
        """Formats the results as a table for a terminal."""
        lines = [f"{found['n']} misses of the paper's door and {found['n']} by faster run-ups, "
                 f"seed {found['seed']}, engine {found['engine']}", "",
                 f"{'':10}{'stood':>11}{'fell':>6}{'announced':>11}{'needless':>10}{'refused':>9}"
                 f"{'capture reserve [mm]':>22}{'ZMP margin [mm]':>17}   (of those that stood)"]
        for group in GROUPS:
            row = found[group]
            lines.append(
                f"  {group:8}{row['stood']:>5} of {row['n']:<3}{row['fell']:>6}"
                f"{row['announced']:>11}{row['needless']:>10}{row['refused']:>9}"
                f"{shown(row['missed_margin_mm']['min']):>22}"
                f"{shown(row['margin_of_standing_mm']['min']):>17}")
        lost = [f"{worst_line(r)}; {r['case']['target_deg']:.1f} deg" + (
            "" if "refused" in r else
            f", capture reserve {r['missed_margin_mm']:.0f} mm"
            f"{'' if r['announced'] else ', not announced'}")
            for r in found["runs"] if not r["stood"]]
        return "\n".join([*lines, *([""] + lost if lost else []), *replay_lines(found)])

    def figure(self, found: dict[str, Any], path: Path) -> None:
        """Draws the capture reserve, the margin and the tilt over angle and reserve."""
        from door_impact_evaluation.sweep.drawing import Panel, draw

        angle, reserve = "desired angle [deg]", "capture reserve of the plan [mm]"
        panels = [
            Panel(angle, reserve, lambda r: r["case"]["target_deg"],
                  lambda r: r["missed_margin_mm"], (0.0,)),
            Panel(reserve, "largest tilt [deg]", lambda r: r["missed_margin_mm"],
                  lambda r: r["tilt_deg"]),
            Panel(reserve, "smallest ZMP margin [mm]", lambda r: r["missed_margin_mm"],
                  lambda r: r["margin_mm"] if r["stood"] else None, (0.0,)),
            Panel("planned speed of B [m/s]", "largest tilt [deg]", lambda r: r["v_rb"],
                  lambda r: r["tilt_deg"]),
        ]
        draw(panels, {group: [r for r in found["runs"] if r["case"]["group"] == group]
                      for group in GROUPS}, path)

    def replay(self, case: MissCase, engine: str, number: int) -> Replay:
        """Simulates a miss again, and makes its replay."""
        from door_impact_evaluation.report.motion_replay import replay_of_motion

        run, robot = _missed(case, engine), load_robot_config()
        return replay_of_motion(
            run.log, evaluation.support(run.log.motion, robot, window=evaluation.WINDOW), robot,
            run.phases())


def _missed(case: MissCase, engine: str) -> Rehearsal:
    with tempfile.TemporaryDirectory() as folder:
        return rehearse(
            case.target_deg, Path(folder) / "log.npz", door=case.door, door_offset=AWAY,
            run_up=case.run_up, engine=engine, friction=case.friction, seed=case.seed)


def _measured(run: Rehearsal) -> Record:
    plan, motion = run.plan, run.log.motion
    tilt = evaluation.tilt(motion.base_orientation)
    margin = known(evaluation.support(
        motion, load_robot_config(), window=evaluation.WINDOW).margin.tolist())
    return {
        "outcome": run.execution.outcome.value,
        "stood": not run.log.fell and bool(tilt[-1] < UPRIGHT),
        "fell": run.log.fell,
        "missed_margin_mm": 1e3 * plan.missed_margin,
        "announced": not plan.stands_if_missed,
        "v_rb": plan.v_rb,
        "margin_mm": 1e3 * float(margin.min()) if margin.size else None,
        "tilt_deg": float(np.degrees(tilt.max())),
    }


def _of_group(records: list[Record]) -> dict[str, Any]:
    done = [r for r in records if "refused" not in r]
    fell = [r for r in done if not r["stood"]]
    return {
        "n": len(records), "stood": len(done) - len(fell), "fell": len(fell),
        "announced": sum(r["announced"] for r in fell),
        "needless": sum(r["announced"] for r in done if r["stood"]),
        "refused": len(records) - len(done),
        "missed_margin_mm": smallest(r["missed_margin_mm"] for r in done),
        "margin_of_standing_mm": smallest(r["margin_mm"] for r in done if r["stood"]),
        "unannounced": [r["name"] for r in sorted(
            fell, key=lambda r: -goodness(r["missed_margin_mm"])) if not r["announced"]],
    }

"""Kind ``hit``: hits on doors that differ from what the planner knows of them."""

from itertools import islice
from pathlib import Path
from typing import Any

from door_impact_view.replay.recording import Replay

from door_impact_evaluation.run.rehearsal import Rehearsal
from door_impact_evaluation.sweep.hit_cases import HitCase, hit_cases
from door_impact_evaluation.sweep.hit_runs import by_error, hits, run_case
from door_impact_evaluation.sweep.kind import BadRun, Kind, Record, bad_runs
from door_impact_evaluation.sweep.numbers import goodness, shown, smallest, statistics

ERRORS, MARGINS, FALLEN = 2, 2, 3  # most runs that are shown for each reason


class Hit(Kind):
    """Hits on nominal, perturbed and rough doors (`hit_cases`)."""

    name = "hit"
    unit = "door"
    part = "hit"
    what = "hits perturbed doors and reports how far they opened"

    def cases(self, n: int, seed: int) -> list[HitCase]:
        """Draws the cases; see `hit_cases`."""
        return hit_cases(n, seed)

    def run(self, case: HitCase, engine: str) -> list[Record]:
        """Runs the hits of a case; see `run_case`."""
        return run_case(case, engine)

    def numbers(self, records: list[Record]) -> dict[str, Any]:
        """Computes the figures; "stood" and "contacts_one" count first hits on perturbed doors."""
        def of(group: str, hit: int) -> list[Record]:
            return [r for r in records if r["case"]["group"] == group and r["hit"] == hit]

        def errors(group: str, hit: int) -> list[float | None]:
            return [r["error_deg"] for r in of(group, hit) if "error_deg" in r]

        first = of("perturbed", 0)
        hit = [r for r in records if "error_deg" in r]
        phases = list(dict.fromkeys(name for r in hit for name in r["margin_mm"]))
        return {
            "stood": sum(r.get("stood", False) for r in first),
            "error_deg": statistics(errors("perturbed", 0)),
            "after_learning": statistics(errors("rough", 1)),
            "before_learning": statistics(errors("rough", 0)),
            "refused": sum("refused" in r for r in records),
            "min_margin_mm": {name: smallest(r["margin_mm"].get(name) for r in hit)
                              for name in phases},
            "contacts_one": sum(r.get("contacts") == 1 for r in first),
            "nominal": of("nominal", 0) + of("nominal", 1),
        }

    def worst(self, records: list[Record]) -> list[BadRun]:
        """Chooses the runs with a replay.

        These are up to `FALLEN` runs in which the robot did not stand or missed the door, the
        `ERRORS` runs with the largest error of the angle, and the `MARGINS` runs with the smallest
        ZMP margin.
        """
        done = [record for record in records if "refused" not in record]
        hit = [record for record in done if "error_deg" in record]
        lost = [(record, "the robot did not stand" if not record["stood"] else "no contact")
                for record in done if not record["stood"] or "error_deg" not in record]
        far = [(record, f"largest angle {shown(record['error_deg'], '+.2f')} deg from the desired "
                "one") for record in sorted(hit, key=by_error)]
        near = [(record, f"ZMP margin {shown(margin)} mm in {phase}") for record, (margin, phase)
                in ((record, _margin(record)) for record in sorted(hit, key=_margin))]
        return bad_runs(self, [*lost[:FALLEN], *far[:ERRORS], *near[:MARGINS]])

    def table(self, found: dict[str, Any]) -> str:
        """Formats the results as a table for a terminal."""
        from door_impact_evaluation.sweep import hit_report

        return hit_report.table(found)

    def figure(self, found: dict[str, Any], path: Path) -> None:
        """Draws the distributions of errors, margins and latencies."""
        from door_impact_evaluation.sweep import hit_report

        hit_report.figure(found, path)

    def replay(self, case: HitCase, engine: str, number: int) -> Replay:
        """Simulates a hit again with those before it, and makes its replay."""
        from door_impact_evaluation.report.rehearsal_replay import replay_of_rehearsal

        found = next(islice(hits(case, engine), number, None))
        if not isinstance(found, Rehearsal):
            raise found
        return replay_of_rehearsal(found, case.config())


def _margin(record: Record) -> tuple[float, str]:
    """Returns the smallest ZMP margin of a run [mm] and its phase."""
    return min((goodness(margin), phase) for phase, margin in record["margin_mm"].items())

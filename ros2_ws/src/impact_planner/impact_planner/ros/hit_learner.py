"""Learning from reports of hits, for the node impact_planner."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from door_impact_common.errors import DoorImpactError, OutputError
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport

from impact_planner.errors import ImplausibleHit
from impact_planner.hit.learning import HitMemory, Lesson
from impact_planner.impact_plan import ImpactPlan, observed_hit
from impact_planner.task.experience import Experience, load, save
from impact_planner.task.known_door import KnownDoor

_LEARNED = (ExecuteDoorImpact.Result.NONE, ExecuteDoorImpact.Result.NOT_HELD)
"""Error codes of hits that are learned from; the others say that the motion was disturbed."""


class HitLearner:
    """Keeps what hits have taught of each door, and learns from the reports that count.

    Args:
        file: File that keeps the experience; None means that it is lost with the node.
        logger: The node's logger.

    Raises:
        InvalidRequest: The file cannot be read.
    """

    def __init__(
        self, file: Path | None, logger: Any
    ) -> None:
        self._file, self._logger = file, logger
        self._memory = HitMemory(load(file) if file else {})
        self._last: tuple[ImpactPlan, KnownDoor] | None = None

    def experience(self, door: str) -> Experience | None:
        """What hits have taught of the door with this name; None before the first hit."""
        return self._memory.known.get(door)

    def planned(self, plan: ImpactPlan, known: KnownDoor) -> None:
        """Keep the last plan, whose hits are learned from, and the door that it is for."""
        self._last = (plan, known)

    def on_report(self, report: HitReport) -> None:
        """Learn from the report of a hit."""
        try:
            plan, (before, after, replaced) = self._learned(report)
        except DoorImpactError as error:
            self._logger.warning(
                f"nothing was learned from the hit of plan {report.plan_id!r}, which opened the "
                f"door to {math.degrees(report.peak_angle):.1f} deg: {error}")
            return
        self._store()
        if replaced:
            self._logger.warning(
                f"two hits in a row contradicted what {before.hits} hits on the door "
                f"{plan.door!r} had taught, and agree with each other: they replace it")
        self._logger.info(
            f"hit {after.hits} opened the door {plan.door!r} to "
            f"{math.degrees(report.peak_angle):.1f} deg, "
            f"{math.degrees(plan.desired_opening_angle):.1f} deg were desired; the restitution "
            f"changes from {before.restitution:.3f} to {after.restitution:.3f}, the effective mass "
            f"from {before.mass_factor:.3f} to {after.mass_factor:.3f} times the model's")

    def forget(self) -> tuple[bool, str]:
        """Forget what hits on all doors have taught.

        Returns:
            Whether the file could be written, and a sentence that names the doors.
        """
        doors = ", ".join(sorted(self._memory.known))
        done = f"the hits on {doors} were forgotten" if doors else "no hit has taught anything yet"
        self._memory.forget()
        stored = self._store()
        rest = "" if stored else f", but {self._file} still has them"
        return stored, done + rest

    def _learned(self, report: HitReport) -> tuple[ImpactPlan, Lesson]:
        """The plan of a hit, and what the hit has changed.

        Raises:
            ImplausibleHit: The hit is not learned from.
            DoorModelError: The door cannot have opened to the reported angle.
        """
        if self._last is None or self._last[0].plan_id != report.plan_id:
            raise ImplausibleHit("it is not the last plan of this node",
                                 quantity="plan_id", value=report.plan_id)
        if report.error_code not in _LEARNED:
            raise ImplausibleHit(
                f"the report has the error code {report.error_code}: only an undisturbed motion is "
                "learned from, whether the door was held or not",
                quantity="error_code", value=report.error_code)
        plan, known = self._last
        return plan, self._memory.learn(
            known.name, observed_hit(plan, known, report), plan.settings.learning_limits,
            plan.settings.restitution)

    def _store(self) -> bool:
        """Write what hits have taught to its file, if there is one; return False on failure."""
        if self._file is None:
            return True
        try:
            save(self._file, self._memory.known)
        except OutputError as error:
            self._logger.error(str(error))
            return False
        return True

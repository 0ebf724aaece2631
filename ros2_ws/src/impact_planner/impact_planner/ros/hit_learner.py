"""Learning from reports of hits, for the node impact_planner."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from action_msgs.msg import GoalStatus, GoalStatusArray
from door_impact_common.errors import DoorImpactError, OutputError
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import HitReport

from impact_planner.errors import ImplausibleHit
from impact_planner.hit.learning import HitMemory, Lesson
from impact_planner.impact_plan import ImpactPlan, observed_hit
from impact_planner.task.experience import Experience, load, save
from impact_planner.task.known_door import KnownDoor

_KEPT = 16  # number of the last goals that are remembered

Report = TypeVar("Report")


@dataclass
class _Goal(Generic[Report]):
    """A goal that was seen running.

    Attributes:
        end: State in which it ended; None while it runs.
        report: Its report; None before it arrives.
        counted: Whether its report has been returned.
    """

    end: int | None = None
    report: Report | None = None
    counted: bool = False


class GoalReports(Generic[Report]):
    """Brings together goals and their reports, which arrive on different topics in any order.

    Whoever publishes a report can invent it, but cannot make a goal run. Therefore the states of
    the goals must come from elsewhere, which is the action's own topic.
    """

    def __init__(self) -> None:
        self._goals: dict[bytes, _Goal[Report]] = {}

    def goal(self, name: bytes, end: int | None) -> tuple[Report, int] | None:
        """Note the state of a goal.

        Args:
            name: Identifier of the goal.
            end: State in which the goal has ended; None while it runs.

        Returns:
            The report that counts now, and the state in which its goal ended; None if no report
            does.
        """
        goal = self._goals.get(name)
        if goal is None:
            if end is None:
                self._goals[name] = _Goal()
                if len(self._goals) > _KEPT:
                    del self._goals[next(iter(self._goals))]
            return None  # a goal that ended before it was seen running may have run for others
        goal.end = end
        return _complete(goal)

    def report(self, name: bytes, report: Report) -> tuple[Report, int] | None:
        """Note a report, which waits for the end of its goal.

        Args:
            name: Identifier of the goal that the report names.
            report: The report.

        Returns:
            As `goal` does.

        Raises:
            ImplausibleHit: No such goal was seen running, or it has a report already.
        """
        goal = self._goals.get(name)
        if goal is None:
            raise ImplausibleHit(
                f"no goal {name.hex()} was seen running", quantity="goal_id", value=name.hex())
        if goal.report is not None:
            raise ImplausibleHit(
                f"the goal {name.hex()} has a report already, and only the first one counts",
                quantity="goal_id", value=name.hex())
        goal.report = report
        return _complete(goal)


def _complete(goal: _Goal[Report]) -> tuple[Report, int] | None:
    """The goal's report and end where both are known, once."""
    if goal.counted or goal.report is None or goal.end is None:
        return None
    goal.counted = True
    return goal.report, goal.end


STATES = "execute_door_impact/_action/status"
"""Topic on which the action server publishes the states of its goals."""

# Result's error code of a hit that may be learned from, by the state in which its goal ended. A
# canceled goal has none, and other codes say that the motion was disturbed.
_LEARNED = {
    GoalStatus.STATUS_SUCCEEDED: ExecuteDoorImpact.Result.NONE,
    GoalStatus.STATUS_ABORTED: ExecuteDoorImpact.Result.NOT_HELD,
}
_ENDED = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_ABORTED: "was aborted",
    GoalStatus.STATUS_CANCELED: "was canceled",
}


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
        self._reports: GoalReports[HitReport] = GoalReports()
        self._last: tuple[ImpactPlan, KnownDoor] | None = None

    def experience(self, door: str) -> Experience | None:
        """What hits have taught of the door with this name; None before the first hit."""
        return self._memory.known.get(door)

    def planned(self, plan: ImpactPlan, known: KnownDoor) -> None:
        """Keep the last plan, whose hits are learned from, and the door that it is for."""
        self._last = (plan, known)

    def on_goals(self, message: GoalStatusArray) -> None:
        """Learn from the reports whose goals have ended."""
        for state in message.status_list:
            end = state.status if state.status in _ENDED else None
            counted = self._reports.goal(bytes(state.goal_info.goal_id.uuid), end)
            if counted is not None:
                self._learn(*counted)

    def on_report(self, message: HitReport) -> None:
        """Learn from a report if its goal has ended; otherwise it waits for the goal's end."""
        try:
            counted = self._reports.report(bytes(message.goal_id.uuid), message)
        except ImplausibleHit as error:
            self._refuse(message, error)
            return
        if counted is not None:
            self._learn(*counted)

    def forget(self) -> tuple[bool, str]:
        """Forget what hits on all doors have taught.

        Returns:
            Whether the file could be written, and a sentence that names the doors.
        """
        doors = ", ".join(sorted(self._memory.known)) or "no door"
        self._memory.forget()
        stored = self._store()
        rest = "" if stored else f", but {self._file} still has them"
        return stored, f"the hits on {doors} were forgotten{rest}"

    def _learn(self, report: HitReport, end: int) -> None:
        """Learn from the report of a goal that ended in a state of GoalStatus."""
        try:
            plan, (before, after, replaced) = self._learned(report, end)
        except DoorImpactError as error:
            self._refuse(report, error)
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

    def _learned(self, report: HitReport, end: int) -> tuple[ImpactPlan, Lesson]:
        """The plan of a hit, and what the hit has changed.

        Raises:
            ImplausibleHit: The hit is not learned from.
            DoorModelError: The door cannot have opened to the reported angle.
        """
        if self._last is None or self._last[0].plan_id != report.plan_id:
            raise ImplausibleHit("it is not the last plan of this node",
                                 quantity="plan_id", value=report.plan_id)
        if _LEARNED.get(end) != report.error_code:
            raise ImplausibleHit(
                f"its goal {_ENDED[end]}, and the report has the error code {report.error_code}: "
                "only an undisturbed motion is learned from, whether the door was held or not",
                quantity="error_code", value=report.error_code)
        plan, known = self._last
        return plan, self._memory.learn(
            known.name, observed_hit(plan, known, report), plan.settings.learning_limits,
            plan.settings.restitution)

    def _refuse(self, report: HitReport, error: DoorImpactError) -> None:
        """Say why nothing is learned from a report."""
        self._logger.warning(
            f"nothing was learned from the hit of plan {report.plan_id!r}, which opened the door "
            f"to {math.degrees(report.peak_angle):.1f} deg: {error}")

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

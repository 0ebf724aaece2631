"""Which reports count: one for each goal that was executed and has ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from impact_planner.errors import ImplausibleHit

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

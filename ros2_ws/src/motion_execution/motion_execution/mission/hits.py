"""Executes hits."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hrp2_description.robot import SIDES
from impact_planner.errors import GoalRefused, InvalidRequest
from impact_planner.motion.missed import needed_reserve
from robot_driver.names import DOOR

from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import STANDING_SIDE, PointB
from motion_execution.hit.preflight import require_ready, require_speed_scale
from motion_execution.mission.body import PATIENCE, STANDING, Body
from motion_execution.mission.hit_plan import HitPlan
from motion_execution.mission.link import Link
from motion_execution.mission.order import Order
from motion_execution.settings import ExecutionSettings

TOPICS = (*STANDING, DOOR)
PROBES = ("auto", "on", "off")


@dataclass(frozen=True)
class HitProgress:
    """How far a hit has come; the names are those of the action's feedback."""

    phase: str
    progress: float
    zmp_margin: float
    planned_zmp_margin: float
    door_angle: float


class Hits:
    """Executes hits.

    Args:
        body: The robot.
        link: Messages to and from it.
        settings: Thresholds.
    """

    def __init__(self, body: Body, link: Link, settings: ExecutionSettings) -> None:
        self._body, self._link, self._settings = body, link, settings
        self._point_b = PointB(body.model)
        self._plan: HitPlan | None = None  # of the hit under way

    async def make(
        self, plan: HitPlan, order: Order, *, probe: str = "auto", speed_scale: float = 1.0,
        dry_run: bool = False,
    ) -> Execution | None:
        """Execute a plan, and return the execution after its end; None after a dry run.

        Args:
            probe: Whether the leaf is touched slowly first: on, off, or auto where the plan's
                `missed_margin` asks for it.
            speed_scale: Factor on the speed of the phases before the run-up.
            dry_run: Whether nothing but the motion is done.

        Raises:
            GoalRefused: It cannot be executed.
            NotReady: Messages are missing or old.
            Stopped: The order was taken back.
        """
        require_speed_scale(speed_scale)
        probes = probe == "on" or (
            probe == "auto" and not plan.missed_margin >= needed_reserve(self._body.model.config))
        body = self._body
        await body.wait(lambda: body.inputs.complete(TOPICS), PATIENCE, order)
        body.require_messages(TOPICS)
        assert body.inputs.joints is not None
        now, position, _ = body.inputs.joints
        try:
            execution = Execution(
                plan.executable, self._point_b, self._settings, speed_scale,
                list(body.model.joint_names), probe=probes)
            command = execution.start(now)
            require_ready(body.model, plan.executable, position,
                          body.inputs.door_angle - plan.initial_angle)
        except (InvalidRequest, ValueError, ArithmeticError) as error:  # of any plan's message
            raise GoalRefused("no_plan", f"the plan cannot be executed: {error}") from error
        if dry_run:
            return None
        self._plan = plan
        body.begin(order, execution, command, TOPICS)
        await body.ended(order)
        return execution

    def progress(self, execution: Execution) -> HitProgress:
        """Return how far a hit has come."""
        planned = self._plan.margins if self._plan is not None else {}
        return HitProgress(
            execution.phase, execution.progress(self._link.now()), self.margin(execution),
            planned.get(execution.phase, math.nan), float(execution.door_angle))

    def margin(self, execution: Execution) -> float:
        """Return the distance of the last ZMP from the edge of the phase's soles [m]."""
        return self._body.zmp_margin((STANDING_SIDE,) if execution.phase == "step" else SIDES)

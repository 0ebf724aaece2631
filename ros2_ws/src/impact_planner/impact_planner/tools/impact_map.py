"""Map of the requests that can be planned, over door, angle and restitution, with their limits."""

from __future__ import annotations

import csv
import io
import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from door_impact_common.errors import DoorImpactError
from humanoid_motion.errors import JointLimit
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import PLANNING_ERRORS, AngleUnreachable, InvalidRequest
from impact_planner.hit.placement import placement_for_step
from impact_planner.hit.stance import STEP_SHARES
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import ENDINGS, RUN_UPS, PlannerSettings

# What can stop a plan: key, and its words in tables and pictures.
LIMITS = {
    "run-up": "ZMP in the run-up",
    "balance": "ZMP in another phase",
    "rest": "no rest after the hit",
    "pushes on": "would push the door on",
    "joint": "a joint too fast or at its end",
    "ending": "the leaf cannot be held or left",
    "reach": "out of the legs' reach",
    "bodies": "bodies too near",
    "grip": "the soles would slip",
    "linkage": "the door does not get there",
    "request": "the request itself",
}
# Keys of `LIMITS` by the reason of an error, then by its quantity.
_REASONS = {
    AngleUnreachable.reason: "linkage",
    JointLimit.reason: "joint",
    InvalidRequest.reason: "request",
}
_QUANTITIES = {
    "v_rb [m/s]": "run-up",
    "way to rest [m]": "rest",
    "pushed on [m]": "pushes on",
    "clearance [m]": "bodies",
    "friction": "grip",
    "slip [m]": "grip",
}
_MARGIN = "ZMP margin [m]"  # its limit depends on the phase
_MARGIN_LIMITS = {"cam": "run-up", "post": "rest"}


@dataclass(frozen=True)
class MapRange:
    """Ranges of a map.

    Attributes:
        doors: Doors with different names.
        angles: Desired opening angles, increasing, (A,) [rad].
        restitutions: Coefficients of restitution, increasing, (E,).
        ending: Ending of every plan, a member of `ENDINGS`.

    Raises:
        InvalidRequest: Two doors have the same name, or a number is outside its range.
    """

    doors: tuple[KnownDoor, ...]
    angles: tuple[float, ...]
    restitutions: tuple[float, ...]
    ending: str

    def __post_init__(self) -> None:
        """Check names and numbers, which would otherwise be refused in every cell."""
        names = [door.name for door in self.doors]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InvalidRequest(
                f"two doors are called {twice!r}, but names must differ; rename one of them",
                quantity="doors", value=twice, limit="one")
        for angle in self.angles:
            if not 0.0 < angle <= math.pi:
                raise InvalidRequest(
                    f"angles must be above 0 and at most 180 deg, not {math.degrees(angle):g}",
                    quantity="angles [rad]", value=angle, limit=(0.0, math.pi))
        for e in self.restitutions:
            if not 0.0 <= e <= 1.0:
                raise InvalidRequest(
                    f"restitutions must be from 0 to 1, not {e:g}",
                    quantity="restitutions", value=e, limit=(0.0, 1.0))

    def __len__(self) -> int:
        """Number of cells."""
        return len(self.doors) * len(self.angles) * len(self.restitutions) * len(RUN_UPS)


@dataclass(frozen=True)
class Cell:
    """One request and its result; what does not apply is NaN or empty.

    Attributes:
        door: Name of the door.
        angle: Desired opening angle [rad].
        restitution: Coefficient of restitution.
        run_up: Time law of the run-up, a member of `RUN_UPS`.
        v_rb: Speed of B before the hit [m/s].
        cam_margin: Smallest ZMP margin of the run-up until the hit [m].
        margin: Smallest ZMP margin of all phases [m].
        step: Length of the right foot's step [m].
        code: Error code of the refusal; empty where a plan exists.
        limit: Key of `LIMITS` for what stops even the shortest step.
        quantity: Quantity of the refusal for the nominal step, with its unit.
        value: Value of that quantity.
        reason: Sentence of the refusal for the nominal step.
    """

    door: str
    angle: float
    restitution: float
    run_up: str
    v_rb: float = math.nan
    cam_margin: float = math.nan
    margin: float = math.nan
    step: float = math.nan
    code: str = ""
    limit: str = ""
    quantity: str = ""
    value: object = math.nan
    reason: str = ""

    @property
    def feasible(self) -> bool:
        """Whether the request can be planned."""
        return not self.code


@dataclass(frozen=True)
class Largest:
    """The largest angle of the map to which a run-up opens a door.

    Attributes:
        door: Name of the door.
        restitution: Coefficient of restitution.
        run_up: Time law of the run-up, a member of `RUN_UPS`.
        angle: Largest feasible angle [rad]; NaN where no angle is feasible.
        v_rb: Speed of B for the largest angle [m/s].
        smallest: Smallest feasible angle [rad].
        gaps: Number of refused angles between smallest and largest angle.
        beyond: Key of `LIMITS` for what stops the next larger angle, or the first angle where no
            angle is feasible; empty at the end of the map.
    """

    door: str
    restitution: float
    run_up: str
    angle: float
    v_rb: float
    smallest: float
    gaps: int
    beyond: str


def map_cells(
    over: MapRange, robot: RobotModel, settings: PlannerSettings | None = None
) -> Iterator[Cell]:
    """Plan every request of a map, one after another.

    Args:
        over: Ranges of the map.
        robot: The robot.
        settings: Configuration; None means the defaults, with which the planner chooses where the
            robot stands.
    """
    settings = settings or PlannerSettings()
    for door, e, run_up, angle in itertools.product(
            over.doors, over.restitutions, RUN_UPS, over.angles):
        request = PlanRequest(angle, restitution=e, run_up=run_up, ending=over.ending)
        cell = Cell(door.name, angle, e, run_up)
        try:
            yield _planned(cell, plan_impact(request, door, robot, settings))
        except PLANNING_ERRORS as error:
            last = _last_refusal(error, request, door, robot, settings)
            yield replace(
                cell, code=error.reason.upper(), limit=limit_of(last), quantity=error.quantity,
                value=math.nan if error.value is None else error.value, reason=str(error))


def _planned(cell: Cell, plan: ImpactPlan) -> Cell:
    """The cell with the figures of its plan."""
    margins = plan.zmp_margins
    return replace(
        cell, v_rb=plan.v_rb, cam_margin=margins["cam"], margin=min(margins.values()),
        step=plan.hit.stance.step)


def _last_refusal(
    error: DoorImpactError, request: PlanRequest, known: KnownDoor, robot: RobotModel,
    settings: PlannerSettings,
) -> DoorImpactError:
    """The refusal of the shortest step; `error` is that of the nominal step.

    Both are the same where the planner has tried no other step.
    """
    if settings.door_distance is not None or isinstance(error, AngleUnreachable | InvalidRequest):
        return error
    shortest = placement_for_step(robot, settings, STEP_SHARES[-1] * robot.config.step.nominal)
    there = replace(
        settings, door_distance=shortest.door_distance, hinge_x=shortest.hinge_x)
    try:
        plan_impact(request, known, robot, there)
    except PLANNING_ERRORS as last:
        return last
    return error


def limit_of(error: DoorImpactError) -> str:
    """Key of `LIMITS` for what stops a plan, by the error's phase, reason and quantity."""
    if error.phase in ENDINGS:
        return "ending"
    if error.quantity == _MARGIN:
        return _MARGIN_LIMITS.get(error.phase, "balance")
    return _REASONS.get(error.reason) or _QUANTITIES.get(error.quantity, "reach")


def largest_angles(cells: Sequence[Cell]) -> list[Largest]:
    """The largest angle of each door, restitution and run-up, in the order of the cells."""
    rows: dict[tuple[str, float, str], list[Cell]] = {}
    for cell in cells:
        rows.setdefault((cell.door, cell.restitution, cell.run_up), []).append(cell)
    return [_largest(row) for row in rows.values()]


def _largest(row: Sequence[Cell]) -> Largest:
    """The largest angle of cells that differ only in their angle."""
    good = [i for i, cell in enumerate(row) if cell.feasible]
    first, last = (good[0], good[-1]) if good else (0, -1)
    top = row[last] if good else None
    return Largest(
        row[0].door, row[0].restitution, row[0].run_up,
        angle=top.angle if top else math.nan,
        v_rb=top.v_rb if top else math.nan,
        smallest=row[first].angle if top else math.nan,
        gaps=last - first + 1 - len(good) if top else 0,
        beyond=row[last + 1].limit if last + 1 < len(row) else "",
    )


# Keys and factors of the figures whose unit in files differs from SI.
_UNITS = {
    "angle": ("angle_deg", math.degrees(1.0)), "v_rb": ("v_rb_m_s", 1.0),
    "cam_margin": ("cam_margin_mm", 1e3), "margin": ("margin_mm", 1e3), "step": ("step_m", 1.0),
}  # fmt: skip


def cell_object(cell: Cell) -> dict[str, Any]:
    """A cell as a JSON object whose keys name the unit; None where a figure does not apply."""
    found: dict[str, Any] = {}
    for name, value in asdict(cell).items():
        key, factor = _UNITS.get(name, (name, 1.0))
        if isinstance(value, float):
            found[key] = float(f"{value * factor:.6g}") if math.isfinite(value) else None
        else:
            found[key] = value or None
    found["feasible"] = cell.feasible
    return found


def csv_text(cells: Iterable[Cell]) -> str:
    """Cells as the text of a CSV file, without the sentences of the refusals."""
    rows = [cell_object(cell) for cell in cells]
    names = [name for name in rows[0] if name not in ("reason", "feasible")]
    text = io.StringIO()
    writer = csv.DictWriter(text, names, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def table(cells: Sequence[Cell]) -> str:
    """The largest angles as a Markdown table with a row for each door and restitution."""
    lines = [
        "| door | e | " + " | ".join(f"{name} [deg] | v_rB [m/s]" for name in RUN_UPS)
        + " | beyond |",
        "| --- | --- |" + " --- | --- |" * len(RUN_UPS) + " --- |",
    ]
    found = {(one.door, one.restitution, one.run_up): one for one in largest_angles(cells)}
    for door, e in dict.fromkeys((cell.door, cell.restitution) for cell in cells):
        row = [found[door, e, run_up] for run_up in RUN_UPS]
        words = [f"{_angles(one)} | {_speed(one)}" for one in row]
        beyond = LIMITS.get(row[-1].beyond, "the map's end")
        lines.append(f"| {door} | {e:g} | " + " | ".join(words) + f" | {beyond} |")
    return "\n".join(lines)


def _angles(one: Largest) -> str:
    """Words for the feasible angles [deg]."""
    if math.isnan(one.angle):
        return "none"
    low, high = math.degrees(one.smallest), math.degrees(one.angle)
    gaps = f" but {one.gaps}" if one.gaps else ""
    return f"{low:.4g} to {high:.4g}{gaps}"


def _speed(one: Largest) -> str:
    """Words for the speed of B [m/s]."""
    return "" if math.isnan(one.v_rb) else f"{one.v_rb:.3f}"

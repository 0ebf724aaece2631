"""The texts of the page, as HTML.

Texts of nodes are escaped: they are shown as they are, and no part of them is run by the browser.
"""

from __future__ import annotations

import math
from html import escape

from door_impact_view.live.orders import Answer, Identify, Order, Plan, Push, Reset, Run, Stop
from door_impact_view.live.state import PlanSummary

SHOW_ONLY = (
    "This page only shows: the view was started for other machines without a view_token, so it "
    "has no buttons.")
NO_PLAN = "There is no plan yet."
_CELL = 'style="padding:1px 6px;text-align:left;vertical-align:top"'
_BAD, _GOOD = "#b00020", "#00695c"


def order_text(order: Order) -> str:
    """Return what an order is, such as "Plan a hit for 25.0 deg"."""
    match order:
        case Push():
            return f"Push the door with {order.impulse:.1f} N m s"
        case Identify():
            return "Identify the closer"
        case Plan():
            return f"Plan a hit for {math.degrees(order.angle):.1f} deg"
        case Run():
            return "Run the plan"
        case Stop():
            return "Stop"
        case Reset():
            return "Reset the simulation"


def answer_html(order: Order, answer: Answer | None) -> str:
    """Return the line that stays below the buttons.

    Args:
        order: What was asked for.
        answer: What came of it; None as long as nothing did.
    """
    if answer is None:
        return _paragraph(f"{order_text(order)}: waiting for the answer.")
    color = _GOOD if answer.done else _BAD
    state = "done" if answer.done else "not done"
    return _paragraph(f"{order_text(order)}: {state}. {answer.text}", color)


def plan_html(plan: PlanSummary | None) -> str:
    """Return the table of a plan with margins and warnings."""
    if plan is None:
        return _paragraph(NO_PLAN)
    rows = [f"<tr><td {_CELL}>{escape(name)}</td><td {_CELL}><b>{escape(value)}</b></td></tr>"
            for name, value in plan.rows]
    rows += [f"<tr><td {_CELL}>ZMP margin, {escape(phase)}</td>"
             f'<td {_CELL}><b style="color:{_GOOD if margin > 0.0 else _BAD}">'
             f"{1e3 * margin:.1f} mm</b></td></tr>" for phase, margin in plan.margins]
    warnings = "".join(_paragraph(f"Warning: {text}", _BAD) for text in plan.warnings)
    return f'<table style="font-size:85%">{"".join(rows)}</table>{warnings}'


def state_html(
    phase: str, angle: float | None, margin: float | None, problem: str
) -> str:
    """Return the line about the present state.

    Args:
        phase: What the executor does; empty: nothing.
        angle: Opening angle of the door [rad], if known.
        margin: Distance of the ZMP to the edge of the support polygon [m], if known.
        problem: What cannot be drawn; empty: nothing.
    """
    door = "door not known" if angle is None else f"door {_tenths(math.degrees(angle))} deg"
    known = "ZMP margin not known" if margin is None else f"ZMP margin {1e3 * margin:.0f} mm"
    text = _paragraph(f"{phase or 'no motion'}; {door}; {known}")
    return text + (_paragraph(problem, _BAD) if problem else "")


def note_html(text: str) -> str:
    """Return a sentence as a paragraph."""
    return _paragraph(text)


def _tenths(value: float) -> str:
    return f"{round(value, 1) + 0.0:.1f}"  # the sum has no -0.0


def _paragraph(text: str, color: str = "inherit") -> str:
    return (f'<p style="margin:2px 10px;font-size:85%;color:{color};overflow-wrap:anywhere">'
            f"{escape(text)}</p>")

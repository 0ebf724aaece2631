"""The buttons of the page, what they order, and the texts beside them.

Texts of nodes are escaped: they are shown as they are, and no part of them is run by the browser.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Any, Literal

import viser

from door_impact_view.live.state import PlanSummary, State

CONFIGURED = "as configured"
RUN_UPS = ("mcv50", "zmp_limited")  # of PlanDoorImpact.srv
ENDINGS = ("hold", "retreat", "pass")
_SHOWN = 12.0  # time for which a notification stays [s]
_CELL = 'style="padding:1px 6px;text-align:left;vertical-align:top"'
_BAD, _GOOD = "#b00020", "#00695c"

Name = Literal["push", "identify", "plan", "run", "pass", "stop", "reset"]
Reply = Callable[[bool, str], None]
"""Takes whether an order was done, and a sentence of the node that was asked or of this one."""


@dataclass(frozen=True)
class Order:
    """What a button orders.

    Attributes:
        name: Which order.
        text: The order for readers, such as "Plan a hit for 25.0 deg".
        fields: Values of fields of the request [SI units]; others are as the interface has them.
    """

    name: Name
    text: str
    fields: Mapping[str, Any] = field(default_factory=dict)


GiveOrder = Callable[[Order, Reply], None]
"""Takes an order from any thread and returns at once; the reply is called later, once."""


class Panels:
    """The buttons, which all browsers share.

    Args:
        server: viser's server.
        give: Takes the orders.
    """

    def __init__(self, server: viser.ViserServer, give: GiveOrder) -> None:
        self._server, self._give = server, give
        gui = server.gui
        with gui.add_folder("Door", order=0.0):
            impulse = gui.add_number("impulse [N m s]", 8.0, min=0.5, max=30.0, step=0.5)
            self._button("Push the door", lambda: Order(
                "push", f"Push the door with {impulse.value:.1f} N m s",
                {"impulse": float(impulse.value)}), "Simulation only")
            self._button("Identify", lambda: Order("identify", "Identify the closer"),
                         "From the pushes so far")
        with gui.add_folder("Plan a hit", order=0.1):
            angle = gui.add_slider("angle [deg]", 5.0, 60.0, 0.5, 25.0)
            run_up = gui.add_dropdown("run-up", (CONFIGURED, *RUN_UPS))
            ending = gui.add_dropdown("ending", (CONFIGURED, *ENDINGS))
            self._button("Plan", lambda: Order(
                "plan", f"Plan a hit for {angle.value:.1f} deg", {
                    "desired_opening_angle": math.radians(angle.value),
                    "run_up": run_up.value.replace(CONFIGURED, ""),
                    "ending": ending.value.replace(CONFIGURED, "")}))
        with gui.add_folder("Robot", order=0.2):
            self._button("Run", lambda: Order("run", "Run the plan"), "Executes the last plan")
            self._button("Walk through the door", lambda: Order("pass", "Walk through the door"),
                         "Hits the door, catches it and walks through")
            self._button("Stop", lambda: Order("stop", "Stop"), "As safely as the phase allows",
                         "red")
            self._button("Reset", lambda: Order("reset", "Reset the simulation"),
                         "Simulation only")
        self._answer = gui.add_html("", order=1.0)

    def _button(self, label: str, order: Callable[[], Order], hint: str | None = None,
                color: Literal["red"] | None = None) -> None:
        button = self._server.gui.add_button(label, hint=hint, color=color)
        button.on_click(lambda _: self._press(order()))

    def _press(self, order: Order) -> None:
        """Give an order, and show every browser what comes of it."""
        self._answer.content = _paragraph(f"{order.text}: waiting for the answer.")

        def reply(done: bool, text: str) -> None:
            title = f"{order.text}: {'done' if done else 'not done'}"  # not by the colour alone
            self._answer.content = answer_html(title, text, done)
            for client in self._server.get_clients().values():
                client.add_notification(title, text, auto_close_seconds=_SHOWN,
                                        color="teal" if done else "red")

        self._give(order, reply)


def answer_html(title: str, text: str, done: bool) -> str:
    """Return the line that stays below the buttons."""
    return _paragraph(f"{title}. {text}", _GOOD if done else _BAD)


def plan_html(plan: PlanSummary | None) -> str:
    """Return the table of a plan with margins and warnings."""
    if plan is None:
        return _paragraph("There is no plan yet.")
    rows = [f"<tr><td {_CELL}>{escape(name)}</td><td {_CELL}><b>{escape(value)}</b></td></tr>"
            for name, value in plan.rows]
    rows += [f"<tr><td {_CELL}>ZMP margin, {escape(phase)}</td>"
             f'<td {_CELL}><b style="color:{_GOOD if margin > 0.0 else _BAD}">'
             f"{1e3 * margin:.1f} mm</b></td></tr>" for phase, margin in plan.margins]
    warnings = "".join(_paragraph(f"Warning: {text}", _BAD) for text in plan.warnings)
    return f'<table style="font-size:85%">{"".join(rows)}</table>{warnings}'


def state_html(state: State) -> str:
    """Return the line about the motion, the door's angle, the ZMP margin and what is not drawn."""
    door = "door not known"
    if state.door_angle is not None:
        angle = round(math.degrees(float(state.door_angle.value[0])), 1)
        door = f"door {angle + 0.0:.1f} deg"  # the sum has no -0.0
    margin = state.margin()
    known = "ZMP margin not known" if margin is None else f"ZMP margin {1e3 * margin:.0f} mm"
    text = _paragraph(f"{state.phase or 'no motion'}; {door}; {known}")
    return text + (_paragraph(state.problem, _BAD) if state.problem else "")


def _paragraph(text: str, color: str = "inherit") -> str:
    return (f'<p style="margin:2px 10px;font-size:85%;color:{color};overflow-wrap:anywhere">'
            f"{escape(text)}</p>")

"""The buttons of the page, what they order, and the texts beside them.

Texts of nodes are escaped: they are shown as they are, and no part of them is run by the browser.
"""

from __future__ import annotations

import math
import re
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
_BAD, _GOOD = "light-dark(#b00020, #ff8a80)", "light-dark(#00695c, #4db6ac)"
# Stop, the only red button, stays in a corner of the picture when the panel is scrolled; folded up,
# the panel would take it along, so it cannot be. In windows of up to 36em viser's panel is a sheet
# at the bottom, whose head folds it: the picture is above it, not behind it.
_STYLE = """<style>
button[style*="red-filled"] {position: fixed; left: 12px; bottom: 12px; z-index: 99; width: 9em}
[aria-label*="ollapse"], [data-dock-minimize] {display: none !important}
@media (max-width: 36em) {
  #root {height: 55%}
  .mantine-Paper-root[style*="fixed"] {width: 100% !important; max-height: 45% !important}
  .mantine-ScrollArea-content > div {width: 100% !important}
  [style*="fixed"] .mantine-ScrollArea-content > div > :first-child {pointer-events: none}
  button[style*="red-filled"] {bottom: calc(45% + 12px)}
}
</style>"""

Name = Literal[
    "push", "identify", "plan", "hit", "walk", "pass", "stop", "reset", "pause", "step"]
BUTTONS: dict[Name, str] = {
    "push": "Push the door", "identify": "Identify", "plan": "Plan", "hit": "Hit", "walk": "Walk",
    "pass": "Walk through the door", "stop": "Stop", "reset": "Reset", "pause": "Pause",
    "step": "Step"}
_HIDDEN = ("pause", "step")  # where nobody serves them: a robot has no such thing
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
        self._buttons: dict[Name, viser.GuiButtonHandle] = {}
        self._paused = False
        gui = server.gui
        gui.add_html(_STYLE)
        self._button("stop", lambda: Order("stop", "Stop"), "As safely as the phase allows", "red")
        with gui.add_folder("Door", order=0.0):
            impulse = gui.add_number("impulse [N m s]", 8.0, min=0.5, max=30.0, step=0.5)
            self._button("push", lambda: Order(
                "push", f"Push the door with {impulse.value:.1f} N m s",
                {"impulse": float(impulse.value)}), "Simulation only")
            self._button("identify", lambda: Order("identify", "Identify the closer"),
                         "From the pushes so far")
        with gui.add_folder("Hit", order=0.1):
            angle = gui.add_slider("angle [deg]", 5.0, 60.0, 0.5, 25.0)
            run_up = gui.add_dropdown("run-up", (CONFIGURED, *RUN_UPS))
            ending = gui.add_dropdown("ending", (CONFIGURED, *ENDINGS))
            self._button("plan", lambda: Order(
                "plan", f"Plan a hit for {angle.value:.1f} deg", {
                    "desired_opening_angle": math.radians(angle.value),
                    "run_up": run_up.value.replace(CONFIGURED, ""),
                    "ending": ending.value.replace(CONFIGURED, "")}))
            self._button("hit", lambda: Order("hit", "Hit the door"), "Executes the last plan")
        with gui.add_folder("Robot", order=0.2):
            goal = gui.add_vector3("x, y [m], turn [deg]", (1.0, 0.3, 0.0), step=0.1,
                                   hint="In the world; a click on the floor sets x and y")
            self._button("walk", lambda: Order(
                "walk", "Walk to x {:.2f} m, y {:.2f} m, turn {:.0f} deg".format(*goal.value),
                dict(zip(("x", "y", "turn"), map(float, goal.value), strict=True))))
            self._button("pass", lambda: Order("pass", "Walk through the door"),
                         "Hits the door, catches it and walks through")
            self._button("reset", lambda: Order("reset", "Reset the simulation"),
                         "Simulation only")
            self._button("pause", lambda: Order(
                "pause", self._buttons["pause"].label, {"data": not self._paused}),
                "Time stands still; Reset ends that, too")
            self._button("step", lambda: Order("step", "Step"), "By 5 ms")
        mark = server.scene.add_frame("/goal", axes_length=0.2, axes_radius=0.01, visible=False)

        @goal.on_update
        def _(_: object) -> None:
            x, y, turn = goal.value
            half = 0.5 * math.radians(turn)
            mark.position, mark.visible = (x, y, 0.0), True
            mark.wxyz = (math.cos(half), 0.0, 0.0, math.sin(half))

        @server.scene.on_click()
        def _(click: viser.SceneClickEvent) -> None:
            (x, y, z), (dx, dy, dz) = click.ray_origin, click.ray_direction
            if dz < 0.0 < z:  # it meets the floor
                goal.value = (  # type: ignore[misc]  # it can be set
                    round(x - dx * z / dz, 2), round(y - dy * z / dz, 2), goal.value[2])

        self._refused = gui.add_html("", order=-0.1)
        self._answer = gui.add_html("", order=1.0)

    def _button(self, name: Name, order: Callable[[], Order], hint: str | None = None,
                color: Literal["red"] | None = None) -> None:
        button = self._buttons[name] = self._server.gui.add_button(
            BUTTONS[name], hint=hint, color=color)
        button.on_click(lambda _: self._press(order()))

    def show(self, state: State) -> None:
        """Disable the buttons that would be refused, and say why; viser sends what is new."""
        why = refusals(state)
        for name, button in self._buttons.items():
            button.disabled = name in why
        self._paused = state.paused
        self._buttons["pause"].label = "Go on" if state.paused else BUTTONS["pause"]
        self._buttons["pause"].visible = "pause" in state.served
        self._buttons["step"].visible = "step" in state.served and state.paused
        reasons: dict[str, list[str]] = {}
        for name, reason in why.items():
            reasons.setdefault(reason, []).append(BUTTONS[name])
        self._refused.content = "".join(_paragraph(f"{', '.join(names)}: {reason}")
                                        for reason, names in reasons.items())

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


def refusals(state: State) -> dict[Name, str]:
    """Return which orders would be refused now, with what is to be done first."""
    why: dict[Name, str] = {name: "the node that does it is not running"
                            for name in BUTTONS if name not in (*state.served, *_HIDDEN)}
    if state.plan is None:
        why.setdefault("hit", "there is no plan yet, press Plan")
    for name in ("hit", "walk", "pass"):
        if state.moving - ({"walk"} if name == "walk" else set()):
            why.setdefault(name, "wait for the end of the motion, or press Stop")
    why.pop("stop", None)
    return why


def name_buttons(text: str, services: Mapping[Name, str]) -> str:
    """Return a node's sentence with the button behind the name of each service or action."""
    for name, service in services.items():
        if "_" in service or "/" in service:  # else it is an English word as well
            text = re.sub(rf"\b{service}\b", rf'\g<0> (button "{BUTTONS[name]}")', text)
    return text


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
    """Return the line about motion, door, ZMP margin and clock, and what is not drawn."""
    door = "door not known"
    if state.door_angle is not None:
        angle = round(math.degrees(float(state.door_angle.value[0])), 1)
        door = f"door {angle + 0.0:.1f} deg"  # the sum has no -0.0
    margin = state.margin()
    known = "ZMP margin not known" if margin is None else f"ZMP margin {1e3 * margin:.0f} mm"
    clock = "" if state.now is None else f"; {state.now:.1f} s"
    if state.paused:
        clock += ", paused"
    elif state.speed is not None:
        clock += f", {state.speed:.2f} times as fast as real time"
    text = _paragraph(f"{state.phase or 'no motion'}; {door}; {known}{clock}")
    return text + (_paragraph(state.problem, _BAD) if state.problem else "")


def _paragraph(text: str, color: str = "inherit") -> str:
    return (f'<p style="margin:2px 10px;font-size:85%;color:{color};overflow-wrap:anywhere">'
            f"{escape(text)}</p>")

"""The buttons of the page.

Every browser gets buttons of its own, after its token if one is wanted: inputs that all browsers
shared could be changed by a browser that may only look.
"""

from __future__ import annotations

import hmac
import math
import threading
import time
from collections.abc import Callable, Collection
from typing import Any

from door_impact_view.live import texts
from door_impact_view.live.orders import (
    Answer,
    GiveOrder,
    Identify,
    Order,
    Plan,
    Push,
    Reset,
    Run,
    Stop,
)

CONFIGURED = "as configured"
RUN_UPS = ("mcv50", "zmp_limited")  # of PlanDoorImpact.srv
ENDINGS = ("hold", "retreat")
_PUSH, _PUSHES = 8.0, (0.5, 30.0)  # impulse of a push at first, and its range [N m s]
_ANGLE, _ANGLES = 25.0, (5.0, 60.0)  # desired angle at first, and its range [deg]
_PAUSE = 1.0  # time after a wrong token in which no token is taken [s]
_SHOWN = 12.0  # time for which a notification stays [s]


class Gate:
    """Decides which browsers get buttons.

    Args:
        token: What has to be entered; empty: nothing.
        local: Whether only this machine can connect.
    """

    def __init__(self, token: str, local: bool) -> None:
        self._token = token.encode()
        self.open = local and not token
        self.closed = not local and not token
        self._lock = threading.Lock()
        self._until = -math.inf  # no token is taken before [s]

    def check(self, token: str, now: float | None = None) -> str:
        """Check a token.

        Args:
            token: What was entered.
            now: Time on a steady clock [s]; by default now.

        Returns:
            The empty text if it is right, else a sentence.
        """
        at = time.monotonic() if now is None else now
        with self._lock:
            if self.closed:
                return texts.SHOW_ONLY
            if at < self._until:
                return "A wrong token was entered a moment ago: wait a second, then try again."
            if self.open or hmac.compare_digest(token.encode(), self._token):
                return ""
            self._until = at + _PAUSE
        return "This is not the view_token that the view was started with."


class Panels:
    """The buttons of every browser.

    Args:
        gate: Who gets buttons.
        give: Takes the orders.
        show: Shows the line about the last order to every browser, as HTML.
        connected: Returns the identifiers of the browsers that are connected.
    """

    def __init__(
        self, gate: Gate, give: GiveOrder, show: Callable[[str], None],
        connected: Callable[[], Collection[int]],
    ) -> None:
        self._gate, self._give, self._show, self._connected = gate, give, show, connected

    def connect(self, client: Any) -> None:
        """Build the panel of a browser that has connected."""
        gui = client.gui
        if self._gate.open:
            self._add_controls(client)
            return
        if self._gate.closed:
            gui.add_html(texts.note_html(texts.SHOW_ONLY), order=0.0)
            return
        token = gui.add_text("view_token", "", order=0.0)
        unlock = gui.add_button("Unlock the buttons", order=0.1)

        @unlock.on_click
        def _(_event: Any) -> None:
            refusal = self._gate.check(str(token.value))
            if refusal:
                _notify(client, "Refused", refusal, done=False)
                return
            token.remove()
            unlock.remove()
            self._add_controls(client)

    def press(self, client: Any, order: Order) -> None:
        """Give an order of a browser, and show what comes of it."""
        self._show(texts.answer_html(order, None))

        def reply(answer: Answer) -> None:
            self._show(texts.answer_html(order, answer))
            if client.client_id in self._connected():  # it may have gone meanwhile
                state = "done" if answer.done else "not done"  # not told by the colour alone
                _notify(client, f"{texts.order_text(order)}: {state}", answer.text,
                        done=answer.done)

        self._give(order, reply)

    def _add_controls(self, client: Any) -> None:
        gui = client.gui
        with gui.add_folder("Door", order=0.0):
            impulse = gui.add_number(
                "impulse [N m s]", _PUSH, min=_PUSHES[0], max=_PUSHES[1], step=0.5)
            self._button(client, "Push the door", lambda: Push(impulse.value),
                         "Simulation only")
            self._button(client, "Identify", Identify, "From the pushes so far")
        with gui.add_folder("Plan a hit", order=0.1):
            angle = gui.add_slider("angle [deg]", *_ANGLES, 0.5, _ANGLE)
            run_up = gui.add_dropdown("run-up", (CONFIGURED, *RUN_UPS))
            ending = gui.add_dropdown("ending", (CONFIGURED, *ENDINGS))
            self._button(client, "Plan", lambda: Plan(
                math.radians(angle.value), _word(run_up.value), _word(ending.value)))
        with gui.add_folder("Robot", order=0.2):
            self._button(client, "Run", Run, "Executes the last plan")
            self._button(client, "Stop", Stop, "As safely as the phase allows", "red")
            self._button(client, "Reset", Reset, "Simulation only")

    def _button(
        self, client: Any, label: str, order: Callable[[], Order], hint: str | None = None,
        color: str | None = None,
    ) -> None:
        button = client.gui.add_button(label, hint=hint, color=color)

        @button.on_click
        def _(_event: Any) -> None:
            self.press(client, order())


def _word(value: Any) -> str:
    return "" if value == CONFIGURED else str(value)


def _notify(client: Any, title: str, text: str, *, done: bool) -> None:
    client.add_notification(
        title, text, auto_close_seconds=_SHOWN, color="teal" if done else "red")

"""The page as a whole, served by viser: what is drawn, plots, texts and buttons."""

from __future__ import annotations

import socket

import numpy as np
import viser
from viser._messages import RunJavascriptMessage

from door_impact_view.errors import AddressError
from door_impact_view.live.panels import GiveOrder, Panels, plan_html, state_html
from door_impact_view.live.plots import Plots
from door_impact_view.live.scene_view import BalanceView, BodyView, FootstepView, ForceView
from door_impact_view.live.state import State

_TITLE = "door impact"
# viser has no other name for the browser's tab, and is dark only by its address.
_SCRIPT = f"""document.title = {_TITLE!r}
if (matchMedia("(prefers-color-scheme: dark)").matches && !location.search)
  location.search = "?darkMode" """
_FLOOR = 6.0  # side of the floor's grid [m]
_FOLLOWED = 0.02  # way of the robot after which the cameras follow [m]
_CAMERA, _LOOK_AT = (2.2, 0.55, 1.5), (0.0, -0.15, 0.8)  # in the world [m]


class Page:
    """The page in the browser.

    Drawing takes place in the thread that calls `draw`; the server has threads of its own.

    Args:
        host: Name or IPv4 address of this machine at which the page is served.
        port: Its port; viser takes the next free one if it is taken, and any free one for 0.
        give: Takes the orders.
        plot_every: Every so many drawings the plots and texts are sent.

    Attributes:
        port: The port that viser has taken.

    Raises:
        AddressError: The address is not this machine's.
    """

    def __init__(self, host: str, port: int, give: GiveOrder, plot_every: int = 5) -> None:
        try:
            socket.create_server((host, 0)).close()
        except (OSError, UnicodeError) as error:  # viser would wait for ever
            raise AddressError(host, f"the page cannot be served there ({error})") from error
        self._server = viser.ViserServer(host, port, label=_TITLE, verbose=False)
        self.port = self._server.get_port()
        self._plot_every, self._drawn = plot_every, 0
        scene, gui = self._server.scene, self._server.gui
        gui._websock_interface.queue_message(RunJavascriptMessage(_SCRIPT))
        gui.configure_theme(show_share_button=False, show_logo=False)
        scene.configure_default_lights(cast_shadow=False)  # they cost most without a graphics card
        scene.add_grid("/floor", width=_FLOOR, height=_FLOOR, shadow_opacity=0.0)
        gui.main_panel.dock_right()  # beside the picture, not over the robot
        self._server.initial_camera.position = _CAMERA
        self._server.initial_camera.look_at = _LOOK_AT
        self._robot = BodyView(self._server, "/robot")
        self._door = BodyView(self._server, "/door")
        self._views = ForceView(scene), BalanceView(scene), FootstepView(scene)
        self._panels = Panels(self._server, give)
        self._follows = gui.add_checkbox("camera follows the robot", True, order=0.3)
        self._known: set[int] = set()  # clients whose cameras follow
        self._place = np.zeros(3)  # of the robot on the floor, when the cameras followed last [m]
        self._state = gui.add_html(state_html(State()), order=-0.2)
        self._plots = Plots(gui)
        with gui.add_folder("Plan", order=3.0):
            self._plan = gui.add_html(plan_html(None))

    @property
    def watched(self) -> bool:
        """Whether a browser is connected."""
        return bool(self._server.get_clients())

    def draw(self, state: State) -> None:
        """Show a state."""
        with self._server.atomic():  # a browser never shows half of it
            self._robot.show(state.robot)
            self._door.show(state.door)
            for view in self._views:
                view.show(state)
        self._follow(state)
        self._plots.add(state)
        if self._drawn % self._plot_every == 0:
            self._plots.send()
            self._panels.show(state)
            self._state.content = state_html(state)
            self._plan.content = plan_html(state.plan)
        self._drawn += 1

    def _follow(self, state: State) -> None:
        """Move the cameras along with the robot, also those of browsers that come later."""
        if state.robot.pose is None or not self._follows.value:
            return
        moved = state.robot.pose[0] * (1.0, 1.0, 0.0) - self._place
        if np.linalg.norm(moved) < _FOLLOWED:
            moved = np.zeros(3)
        self._place = self._place + moved
        first, clients = self._server.initial_camera, self._server.get_clients()
        if moved.any():
            first.position, first.look_at = first.position + moved, first.look_at + moved
        for number, client in clients.items():
            if number not in self._known:  # it has not told yet from where it looks
                client.camera.position, client.camera.look_at = first.position, first.look_at
            elif moved.any():
                client.camera.position = client.camera.position + moved  # looks where it looked
        self._known = set(clients)

    def stop(self) -> None:
        """End the server."""
        self._server.stop()

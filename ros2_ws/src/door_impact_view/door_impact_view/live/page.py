"""The page as a whole: what is drawn at each tick, and what each browser gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from door_impact_view.errors import UrdfError
from door_impact_view.live import texts
from door_impact_view.live.orders import GiveOrder
from door_impact_view.live.panels import Gate, Panels
from door_impact_view.live.plots import Plots
from door_impact_view.live.scene_view import BalanceView, ForceView, ModelView
from door_impact_view.live.server import Listening, start_server, stop_server
from door_impact_view.live.state import State
from door_impact_view.scene.meshes import load_meshes
from door_impact_view.scene.urdf import UrdfScene, read_urdf
from door_impact_view.scene.wall import with_wall

_FLOOR = 6.0  # side of the floor's grid [m]
_CAMERA, _LOOK_AT = (2.2, 0.55, 1.5), (0.0, -0.15, 0.8)  # in the world [m]


@dataclass
class _Drawn:
    """A URDF that is drawn."""

    text: str = ""
    view: ModelView | None = None
    problem: str = ""


class Page:
    """The page in the browser.

    Drawing takes place in the thread that calls `draw`; the server has a thread of its own.

    Args:
        listening: The socket on which it is served.
        token: What a browser has to enter before it gets buttons; empty: nothing on this machine,
            and no buttons for other machines.
        give: Takes the orders.
        plot_every: Every so many ticks the plots are sent.
    """

    def __init__(
        self, listening: Listening, token: str, give: GiveOrder, plot_every: int = 5
    ) -> None:
        self._server = start_server(listening, "door impact")
        self._plot_every = plot_every
        self._ticks = 0
        self._robot, self._door = _Drawn(), _Drawn()
        self._forces: ForceView | None = None
        scene, gui = self._server.scene, self._server.gui
        scene.configure_default_lights(cast_shadow=False)  # they cost most without a graphics card
        scene.add_grid("/floor", width=_FLOOR, height=_FLOOR, shadow_opacity=0.0)
        self._server.initial_camera.position = _CAMERA
        self._server.initial_camera.look_at = _LOOK_AT
        self._balance = BalanceView(scene)
        self._shown = {
            "answer": gui.add_html("", order=1.0),
            "state": gui.add_html(texts.state_html("", None, None, ""), order=1.1)}
        self._plots = Plots(gui, gui.add_folder("The last 20 s", order=2.0))
        with gui.add_folder("Plan", order=3.0):
            self._shown["plan"] = gui.add_html(texts.plan_html(None))
        panels = Panels(Gate(token, listening.local), give,
                        lambda html: self._show("answer", html), self._server.get_clients)
        self._server.on_client_connect(panels.connect)

    @property
    def watched(self) -> bool:
        """Whether a browser is connected."""
        return bool(self._server.get_clients())

    @property
    def problem(self) -> str:
        """Sentence about what cannot be drawn; empty if everything can."""
        return self._robot.problem or self._door.problem

    def draw(self, state: State) -> None:
        """Show a state."""
        with self._server.atomic():  # a browser never shows half of it
            if self._update("/robot", self._robot, state.robot) and self._robot.view is not None:
                self._forces = ForceView(self._server.scene, self._robot.view)
            self._update("/door", self._door, state.door, with_wall)
            if self._robot.view is not None:
                self._robot.view.place(state.base)
                self._robot.view.move(state.joints)
            if self._door.view is not None:
                self._door.view.place(state.door_frame)
                self._door.view.move(state.door_joints)
            if self._forces is not None:
                self._forces.show(state)
            self._balance.show(state)
        self._plots.add(state)
        if self._ticks % self._plot_every == 0:
            self._plots.send()
            angle = None if state.door_angle is None else float(state.door_angle.value[0])
            self._show("state", texts.state_html(
                state.phase, angle, state.margin(), self.problem))
            self._show("plan", texts.plan_html(state.plan))
        self._ticks += 1

    def stop(self) -> None:
        """End the server."""
        stop_server(self._server)

    def _show(self, name: str, html: str) -> None:
        if self._shown[name].content != html:
            self._shown[name].content = html

    def _update(
        self, path: str, drawn: _Drawn, text: str,
        complete: Callable[[UrdfScene], UrdfScene] = lambda model: model,
    ) -> bool:
        """Draw a URDF, made complete, anew if it has changed; return whether it has."""
        if text == drawn.text:
            return False
        drawn.text, drawn.problem = text, ""
        try:
            model = complete(read_urdf(text))
        except UrdfError as error:  # what was drawn before stays
            drawn.problem = str(error)
            return False
        if drawn.view is not None:
            drawn.view.remove()
        meshes, drawn.problem = load_meshes([model])
        drawn.view = ModelView(self._server.scene, path, model, meshes)
        return True

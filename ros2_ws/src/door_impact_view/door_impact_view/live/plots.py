"""The plots of the last seconds: the door's angle, the ZMP margin, forces of feet and hands."""

from __future__ import annotations

from typing import Any

import numpy as np

from door_impact_view.live.state import SPAN, History, Stamped, State
from door_impact_view.scene import colors
from door_impact_view.scene.colors import Rgb

_HEIGHT = 150  # of a plot [pixels]
_LINES = (colors.COM, colors.ZMP, colors.CAPTURE_POINT, colors.DOOR)  # of several curves


class Plot:
    """A plot of one or several curves over the last seconds.

    Args:
        gui: viser's panels.
        title: Quantity with its unit.
        names: Name of each curve.
        lines: Colour of each curve.
    """

    def __init__(
        self, gui: Any, title: str, names: tuple[str, ...], lines: tuple[Rgb, ...]
    ) -> None:
        self._history = History(len(names))
        self._sent = -1.0  # time of the newest sample that was sent [s]
        self._time = -1.0  # time of the newest sample [s]
        series = [{"label": "time [s]"}] + [
            {"label": name, "stroke": colors.css(line), "width": 1.5}
            for name, line in zip(names, lines, strict=True)]
        self._handle = gui.add_uplot(
            tuple(np.zeros((1 + len(names), 1))), tuple(series), title=title, height=_HEIGHT,
            legend={"show": len(names) > 1, "live": False},
            scales={"x": {"time": False, "range": (-SPAN, 0.0)}})

    def add(self, time: float, *values: float) -> None:
        """Add a sample."""
        self._time = time
        self._history.add(time, *values)

    def remove(self) -> None:
        """Remove it from the page."""
        self._handle.remove()

    def send(self) -> None:
        """Send what was added since the last time, if there is something."""
        if self._time == self._sent:
            return
        self._sent = self._time
        self._handle.data = self._history.curves()


class Plots:
    """All plots. A plot appears when its topic does.

    Args:
        gui: viser's panels.
        folder: The folder for the plots.
    """

    def __init__(self, gui: Any, folder: Any) -> None:
        self._gui, self._folder = gui, folder
        with folder:
            self._angle = Plot(gui, "door angle [deg]", ("door angle",), (colors.DOOR,))
            self._margin = Plot(gui, "ZMP margin [mm]", ("ZMP margin",), (colors.ZMP,))
        self._forces: dict[bool, tuple[Plot, tuple[str, ...]]] = {}  # by whether of hands

    def add(self, state: State) -> None:
        """Add what is known now to every plot."""
        if state.door_angle is not None:
            angle = float(np.degrees(state.door_angle.value[0]))
            self._angle.add(state.door_angle.time, angle)
        margin = state.margin()
        if margin is not None and state.zmp is not None:
            self._margin.add(state.zmp.time, 1e3 * margin)
        for hands in (True, False):
            self._add_forces(state, hands)

    def send(self) -> None:
        """Send what is new to the browsers."""
        for plot in (self._angle, self._margin, *(plot for plot, _ in self._forces.values())):
            plot.send()

    def _add_forces(self, state: State, hands: bool) -> None:
        links = tuple(sorted(
            link for link in state.forces if (link in state.hands) == hands))[:len(_LINES)]
        if not links:
            return
        plot, shown = self._forces.get(hands, (None, ()))
        if plot is None or shown != links:
            if plot is not None:
                plot.remove()
            title = "force on the hands [N]" if hands else "vertical force on the feet [N]"
            with self._folder:
                plot = Plot(self._gui, title, links, _LINES[:len(links)])
            self._forces[hands] = plot, links
        items = [state.forces[link] for link in links]
        plot.add(max(item.time for item in items), *(
            np.nan if state.fresh(item) is None else _size(item, hands) for item in items))


def _size(item: Stamped, hand: bool) -> float:
    """Return the size of a hand's force, or the part of a foot's along its z axis [N]."""
    return float(np.linalg.norm(item.value)) if hand else float(item.value[2])

"""The plots of the last seconds: door, ZMP margin, forces, and a signal that is chosen."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import cycle

import numpy as np
import viser
from door_impact_common.arrays import Array
from viser import uplot

from door_impact_view.live.state import Stamped, State
from door_impact_view.scene import colors
from door_impact_view.scene.colors import Rgb
from door_impact_view.scene.urdf import SLIDING

SPAN = 20.0  # time that plots show [s]
_HEIGHT = 150  # of a plot [pixels]
NOTHING = "nothing"
"""The choice of no further signal."""
_AROUND = 10.0  # what the axis of a further signal shows at least around its first values
_LINES = (colors.COM, colors.ZMP, colors.CAPTURE_POINT, colors.DOOR)  # of several curves


class History:
    """The values of a number of curves over the last seconds."""

    def __init__(self, curves: int = 1) -> None:
        self._curves = curves
        self._rows: deque[tuple[float, ...]] = deque()

    def add(self, time: float, *values: float) -> None:
        """Add a sample; one that is not newer than the last is no news, an old one starts anew.

        Args:
            time: Stamp [s].
            values: Value of each curve.
        """
        rows = self._rows
        if rows and time < rows[-1][0]:
            rows.clear()  # the simulation was started again
        if not rows or time > rows[-1][0]:
            rows.append((time, *values))
        while time - rows[0][0] > SPAN:
            rows.popleft()

    def curves(self) -> tuple[Array, ...]:
        """Return times before the newest sample, (N,) [s], and the values of each curve, (N,)."""
        if not self._rows:
            return tuple(np.zeros((1 + self._curves, 0)))
        table = np.array(self._rows).T
        table[0] -= table[0, -1]
        return tuple(table)


class Plot:
    """A plot of one or several curves over the last seconds.

    Args:
        gui: viser's panels.
        title: Quantity with its unit.
        least: What the axis shows at least, so that noise looks small, [from, to].
        names: Name of each curve.
        lines: Colour of each curve.
    """

    def __init__(
        self, gui: viser.GuiApi, title: str, least: tuple[float, float], names: Sequence[str],
        lines: tuple[Rgb, ...]
    ) -> None:
        self.names, self._least = names, least
        self.history = History(len(names))
        series = [uplot.Series(label="time [s]")] + [
            uplot.Series(label=name, stroke=colors.css(line), width=1.5)
            for name, line in zip(names, cycle(lines), strict=False)]
        self.handle = gui.add_uplot(
            tuple(np.zeros((1 + len(names), 1))), tuple(series), title=title, height=_HEIGHT,
            legend=uplot.Legend(show=len(names) > 1, live=False),
            scales=self._scales())

    def _scales(self) -> dict[str, uplot.Scale]:
        """Return both axes; the vertical one grows in quarters of what it shows at least."""
        low, high = self._least
        values = np.append(np.ravel(self.history.curves()[1:]), self._least)
        quarter = 0.25 * (high - low)
        return {"x": uplot.Scale(time=False, range=(-SPAN, 0.0)),
                "y": uplot.Scale(range=(quarter * float(np.floor(np.nanmin(values) / quarter)),
                                        quarter * float(np.ceil(np.nanmax(values) / quarter))))}

    def send(self) -> None:
        """Send what is new to the browsers."""
        self.handle.data = self.history.curves()
        scales = self._scales()
        if scales != self.handle.scales:
            self.handle.scales = scales


class Plots:
    """All plots. A plot appears when its topics do.

    Args:
        gui: viser's panels.

    Attributes:
        shown: The plots by title.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._gui, self._folder = gui, gui.add_folder("The last 20 s", order=2.0)
        self.shown: dict[str, Plot] = {}
        self._further = NOTHING
        with self._folder:
            self._choice = gui.add_dropdown("also plot", (NOTHING,), hint="From now on", order=0.0)

    def add(self, state: State) -> None:
        """Add what is known now to every plot."""
        if state.door_angle is not None:
            angle = float(np.degrees(state.door_angle.value[0]))
            self._plot("door angle [deg]", (0.0, 20.0), ("door angle",), (colors.DOOR,)
                       ).history.add(state.door_angle.time, angle)
        margin = state.margin()
        if margin is not None and state.zmp is not None:
            self._plot("ZMP margin [mm]", (0.0, 120.0), ("ZMP margin",), (colors.ZMP,)
                       ).history.add(state.zmp.time, 1e3 * margin)
        for hands, title, least in ((True, "force on the hands [N]", 40.0),
                                    (False, "vertical force on the feet [N]", 400.0)):
            links = tuple(sorted(link for link in state.forces if (link in state.hands) == hands))
            if links:
                items = [state.forces[link] for link in links]
                plot = self._plot(title, (0.0, least), links, _LINES)
                plot.history.add(max(item.time for item in items), *(
                    np.nan if state.fresh(item) is None else _size(item, hands)
                    for item in items))
        found = signals(state)
        if self._choice.options != (NOTHING, *found):
            self._choice.options = (NOTHING, *found)
        if self._choice.value != self._further:
            if self._further in self.shown:
                self.shown.pop(self._further).handle.remove()
            self._further = self._choice.value
        if self._further in found:
            item, values = found[self._further], np.nan_to_num(found[self._further].value)
            around = float(values.min()) - _AROUND, float(values.max()) + _AROUND
            plot = self._plot(self._further, around, "xyz"[: values.size], _LINES)
            plot.handle.order = 0.1  # below the choice
            plot.history.add(item.time, *item.value)

    def send(self) -> None:
        """Send what is new to the browsers."""
        for plot in self.shown.values():
            plot.send()

    def _plot(self, title: str, least: tuple[float, float], names: Sequence[str],
              lines: tuple[Rgb, ...]) -> Plot:
        """Return a plot of some curves; one of other curves is replaced."""
        plot = self.shown.get(title)
        if plot is None or plot.names != names:
            if plot is not None:
                plot.handle.remove()
            with self._folder:
                plot = self.shown[title] = Plot(self._gui, title, least, names, lines)
        return plot


def signals(state: State) -> dict[str, Stamped]:
    """Return what can be plotted besides, (1,) or along x, y and z, (3,), by name with unit."""
    found = {}
    if state.imu is not None:
        rate, force = np.split(state.imu.value, 2)
        found["IMU: angular velocity [deg/s]"] = Stamped(state.imu.time, np.degrees(rate))
        found["IMU: specific force [m/s²]"] = Stamped(state.imu.time, force)
    found |= {f"force on {link} [N]": force for link, force in sorted(state.forces.items())}
    scene = state.robot.scene
    sliding = {joint.name for joint in scene.joints if joint.kind in SLIDING} if scene else set()
    for name, place in state.robot.joints.items():
        unit, scale = ("mm", 1e3) if name in sliding else ("deg", 180.0 / np.pi)
        found[f"{name} [{unit}]"] = Stamped(state.now or 0.0, np.array([scale * place]))
    return found


def _size(item: Stamped, hand: bool) -> float:
    """Return the size of a hand's force, or the part of a foot's along its z axis [N]."""
    return float(np.linalg.norm(item.value)) if hand else float(item.value[2])

"""Tests of the plots: what a browser gets for what was added to them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from door_impact_view.live.page import Page
from door_impact_view.live.page_client import PageClient
from door_impact_view.live.server import listen
from door_impact_view.live.state import STALE, Stamped, State

SQUARE = np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])


class Shown:
    """A page without robot and door, and what a browser has of its plots."""

    def __init__(self) -> None:
        listening = listen("localhost", 0)
        self.page = Page(listening, "", lambda order, reply: None, plot_every=1)
        self.client = PageClient(listening.port)
        self.client.until(lambda: self.client.has("Plan"))
        self.drawn = 0

    def plot(self, title: str) -> dict[str, Any] | None:
        """A plot by its title."""
        return next((item for item in self.client.elements.values()
                     if item["kind"] == "GuiUplotMessage" and item["title"] == title), None)

    def data(self, title: str) -> list[np.ndarray]:
        """Times and curves of a plot, those of the last drawing."""
        self.page.draw(State())  # changes no plot, and its text tells that everything has come
        self.drawn += 1
        self.page._shown["answer"].content = mark = f"<!-- {self.drawn} -->"
        self.client.until(lambda: mark in self.client.text())
        found = self.plot(title)
        assert found is not None, title
        return list(found["data"])


@pytest.fixture
def shown() -> Iterator[Shown]:
    """A page and its browser."""
    made = Shown()
    yield made
    made.client.close()
    made.page.stop()


def test_angle_and_margin_are_in_degrees_and_millimetres(shown: Shown) -> None:
    """Times count back from the newest sample."""
    for time in (1.0, 1.5, 3.0):
        shown.page.draw(State(
            now=time, door_angle=Stamped(time, np.array([np.radians(10.0 * time)])),
            zmp=Stamped(time, np.array([0.0, 0.02 * time])), polygon=Stamped(time, SQUARE)))
    t, angle = shown.data("door angle [deg]")
    np.testing.assert_allclose(t, [-2.0, -1.5, 0.0])
    np.testing.assert_allclose(angle, [10.0, 15.0, 30.0])
    np.testing.assert_allclose(shown.data("ZMP margin [mm]")[1], [80.0, 70.0, 40.0])


def test_a_sensor_that_is_silent_has_no_value(shown: Shown) -> None:
    """Its curve does not go on with the last value, and the other one goes on."""
    for time in (1.0, 1.0 + 1.1 * STALE):
        shown.page.draw(State(now=time, forces={
            "l_sole": Stamped(1.0, np.array([0.0, 0.0, 200.0])),
            "r_sole": Stamped(time, np.array([0.0, 0.0, 300.0]))}))
    _, left, right = shown.data("vertical force on the feet [N]")
    np.testing.assert_array_equal(left, [200.0, np.nan])
    np.testing.assert_array_equal(right, [300.0, 300.0])

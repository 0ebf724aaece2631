"""Tests of the plots: what a browser gets for what was added to them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from door_impact_view.live.page import Page
from door_impact_view.live.page_client import PageClient
from door_impact_view.live.server import listen
from door_impact_view.live.state import SPAN, STALE, Stamped, State
from door_impact_view.scene import colors

SQUARE = np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])


class Shown:
    """A page without robot and door, and what a browser has of its plots."""

    def __init__(self) -> None:
        listening = listen("localhost", 0)
        self.page = Page(listening, "", lambda order, reply: None, plot_every=1)
        self.client = PageClient(listening.port)
        self.client.until(lambda: self.client.has("Plan"))

    def plot(self, title: str) -> dict[str, Any] | None:
        """A plot by its title."""
        return next((item for item in self.client.elements.values()
                     if item["kind"] == "GuiUplotMessage" and item["title"] == title), None)

    def data(self, title: str) -> list[np.ndarray]:
        """Times and curves of a plot, those of the last drawing."""
        self.page.draw(State())  # changes no plot, and its text tells that everything has come
        self.page._shown["answer"].content = mark = f"<!-- {np.random.default_rng().random()} -->"
        self.client.until(lambda: mark in self.client.text())
        found = self.plot(title)
        assert found is not None, title
        return list(found["data"])

    def labels(self, title: str) -> list[tuple[str, str]]:
        """Name and colour of each curve of a plot."""
        found = self.plot(title)
        assert found is not None, title
        return [(series["label"], series["stroke"]) for series in found["series"][1:]]


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


def test_a_curve_reaches_back_over_its_span_and_begins_anew_after_a_reset(shown: Shown) -> None:
    """What is older has gone; stamps that go back clear it."""
    for time in np.arange(0.0, 2.0 * SPAN, 0.5):
        shown.page.draw(State(door_angle=Stamped(time, np.zeros(1))))
    t, _ = shown.data("door angle [deg]")
    np.testing.assert_allclose((t[0], t[-1]), (-SPAN, 0.0))
    shown.page.draw(State(door_angle=Stamped(0.5, np.ones(1))))
    assert len(shown.data("door angle [deg]")[0]) == 1


def test_a_plot_of_forces_appears_with_its_topic(shown: Shown) -> None:
    """Feet by their vertical force, hands by the force's size; a further one is a further curve."""
    foot = Stamped(1.0, np.array([50.0, 0.0, 300.0]))
    shown.page.draw(State(now=1.0, forces={"l_sole": foot}))
    assert shown.data("vertical force on the feet [N]")[1].tolist() == [300.0]
    assert shown.plot("force on the hands [N]") is None
    hand = Stamped(2.0, np.array([30.0, 0.0, -40.0]))
    both = {"l_sole": Stamped(2.0, foot.value), "r_sole": Stamped(2.0, -foot.value), "hand": hand}
    shown.page.draw(State(now=2.0, forces=both, hands=frozenset({"hand"})))
    assert [row.tolist() for row in shown.data("vertical force on the feet [N]")[1:]] == [
        [300.0], [-300.0]]
    assert shown.data("force on the hands [N]")[1].tolist() == [50.0]
    feet = shown.labels("vertical force on the feet [N]")
    assert feet == [("l_sole", colors.css(colors.COM)), ("r_sole", colors.css(colors.ZMP))]


def test_a_sensor_that_is_silent_has_no_value(shown: Shown) -> None:
    """Its curve does not go on with the last value, and the other one goes on."""
    for time in (1.0, 1.0 + 1.1 * STALE):
        shown.page.draw(State(now=time, forces={
            "l_sole": Stamped(1.0, np.array([0.0, 0.0, 200.0])),
            "r_sole": Stamped(time, np.array([0.0, 0.0, 300.0]))}))
    _, left, right = shown.data("vertical force on the feet [N]")
    np.testing.assert_array_equal(left, [200.0, np.nan])
    np.testing.assert_array_equal(right, [300.0, 300.0])


def test_more_hands_than_colours_are_no_error(shown: Shown) -> None:
    """The first four by name are plotted, each in a colour of its own."""
    forces = {f"hand{k}": Stamped(1.0, np.full(3, float(k))) for k in range(6)}
    shown.page.draw(State(now=1.0, forces=forces, hands=frozenset(forces)))
    assert len(shown.data("force on the hands [N]")) == 5
    labels = shown.labels("force on the hands [N]")
    assert [name for name, _ in labels] == ["hand0", "hand1", "hand2", "hand3"]
    assert len({color for _, color in labels}) == 4


def test_nothing_is_sent_when_nothing_is_new(shown: Shown) -> None:
    """Drawing the same state again costs no message."""
    state = State(now=1.0, door_angle=Stamped(1.0, np.zeros(1)))
    shown.page.draw(state)
    shown.data("door angle [deg]")
    while shown.client.read():
        pass
    before = shown.client.count
    for _ in range(5):
        shown.page.draw(State(now=1.0, door_angle=Stamped(1.0, np.zeros(1))))
    shown.page._shown["answer"].content = "end"
    shown.client.until(lambda: "end" in shown.client.text())
    # Two of each drawing say that what lies between them belongs together.
    assert shown.client.count - before <= 2 * 5 + 2

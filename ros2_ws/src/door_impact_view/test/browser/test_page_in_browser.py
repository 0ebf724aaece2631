"""The page in a real browser: it draws, its buttons work, and its console has no error."""

import io
import math
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from door_impact_view.live.orders import Answer, Order, Plan, Push, Reply
from door_impact_view.live.page import Page
from door_impact_view.live.server import listen
from door_impact_view.live.state import PlanSummary, Stamped, State
from hrp2_description.data import data_path
from PIL import Image

DOOR = """<robot name="door"><link name="frame"><visual><origin xyz="-0.05 -0.02 1"/><geometry>
<box size="0.1 0.04 2"/></geometry></visual></link><link name="leaf"><visual>
<origin xyz="0.45 -0.02 1"/><geometry><box size="0.9 0.04 2"/></geometry></visual></link>
<joint name="hinge" type="revolute"><parent link="frame"/><child link="leaf"/><axis xyz="0 0 -1"/>
</joint></robot>"""

pytestmark = pytest.mark.nightly("starts a browser, which takes seconds and much memory")


class Shown:
    """A page that is drawn all the time, as a node does it, and a browser that shows it."""

    def __init__(self, open_tab: Callable[..., Any]) -> None:
        self.orders: list[Order] = []
        listening = listen("localhost", 0)
        self.state = State(
            robot=data_path("urdf/hrp2.urdf").read_text(encoding="utf-8"), door=DOOR,
            base=(np.array([0.0, 0.0, 0.65]), np.array([1.0, 0.0, 0.0, 0.0])),
            door_frame=(np.array([-0.4, -0.74, 0.0]), np.array([1.0, 0.0, 0.0, 0.0])),
            zmp=Stamped(0.0, np.zeros(2)), com=Stamped(0.0, np.array([0.0, 0.0, 0.8])))
        self.page = Page(listening, "", self.give)
        self._end = threading.Event()
        self._drawing = threading.Thread(target=self._draw)
        self._drawing.start()
        self.tab = open_tab(listening.url)
        self.button("Push the door").wait_for()

    def give(self, order: Order, reply: Reply) -> None:
        """Push and plan; everything else is refused."""
        self.orders.append(order)
        if isinstance(order, Push):
            self.state.door_joints = {"hinge": 1.2}
            reply(Answer(True, "pushed"))
        elif isinstance(order, Plan):
            self.state.plan = PlanSummary("p1", (("v_rB", "0.416 m/s"),), (("cam", 0.018),))
            reply(Answer(True, "planned"))
        else:
            reply(Answer(False, "the robot <must> {first} stand"))

    def button(self, name: str) -> Any:
        """A button of the page."""
        return self.tab.get_by_role("button", name=name, exact=True)

    def picture(self) -> np.ndarray:
        """What the canvas shows, (height, width, 3)."""
        data = self.tab.locator("canvas").first.screenshot()
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=float)

    def end(self) -> None:
        """End page and browser's tab."""
        self.tab.close()
        self._end.set()
        self._drawing.join()
        self.page.stop()

    def _draw(self) -> None:
        time = 0.0
        while not self._end.wait(0.05):
            time += 0.05
            self.state.now = time
            self.state.zmp = Stamped(time, np.array([0.02 * math.sin(time), 0.0]))
            self.state.com = Stamped(time, np.array([0.0, 0.0, 0.8]))
            self.page.draw(self.state)


@pytest.fixture
def shown(open_tab: Callable[..., Any]) -> Iterator[Shown]:
    """A page in the browser."""
    made = Shown(open_tab)
    yield made
    made.end()


def until(shown: Shown, condition: Any) -> None:
    """Wait in the browser until a condition holds."""
    for _ in range(240):
        if condition():
            return
        shown.tab.wait_for_timeout(500)
    raise AssertionError("the browser does not show what was waited for")


def test_robot_and_door_are_drawn_and_the_door_opens(shown: Shown) -> None:
    """The canvas has many colours, and changes where the leaf turns."""
    until(shown, lambda: len(np.unique(shown.picture().reshape(-1, 3), axis=0)) > 200)
    shut = shown.picture()
    shown.button("Push the door").click()
    shown.tab.get_by_text("Push the door with 8.0 N m s: done. pushed").wait_for()
    until(shown, lambda: (np.abs(shown.picture() - shut).max(axis=2) > 30).mean() > 0.01)
    assert shown.orders == [Push(8.0)]


def test_buttons_give_orders_and_show_answers(shown: Shown) -> None:
    """The plan's table appears, and a refusal as its sentence."""
    shown.button("Plan").click()
    shown.tab.get_by_text("0.416 m/s").wait_for()
    shown.tab.get_by_text("18.0 mm").wait_for()
    shown.button("Run").click()
    until(shown, lambda: shown.tab.get_by_text("the robot <must> {first} stand").count() >= 1)
    assert shown.orders[0] == Plan(pytest.approx(math.radians(25.0)), "", "")

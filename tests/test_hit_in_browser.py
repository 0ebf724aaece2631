"""A user's whole way in a real browser: push, identify, plan and run on the page, and the replay.

The pictures of docs/view.md are taken on the way, into the folder that SCREENSHOTS names
(`make screenshots`).
"""

import io
import os
import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from processes import GUARD, Started

SIZE = (1200, 700)  # of the window [pixels]
LARGEST = 300_000  # size of a picture of the documentation [bytes]
IMPULSES = (8.0, 9.5, 8.5)  # of the pushes [N m s]
OPEN = 20.0  # angle from which on the door counts as open, of the 25 deg that are planned [deg]


class Window:
    """A tab, and the folder for its pictures."""

    def __init__(self, tab: Any, folder: Path) -> None:
        self.tab, self._folder = tab, folder

    def until(self, condition: Callable[[], Any]) -> None:
        """Wait until a condition holds."""
        for _ in range(int(GUARD / 0.1)):
            if condition():
                return
            self.tab.wait_for_timeout(100)
        raise AssertionError(f"never shown: {self.tab.inner_text('body')}")

    def door(self) -> float:
        """The door's angle that the page says [deg]."""
        found = re.search(r"door (-?\d+\.\d) deg", self.tab.inner_text("body"))
        return float(found[1]) if found else float("nan")

    def order(self, button: str, done: str) -> None:
        """Press a button and wait for the answer's line, which may come after its notification."""
        self.tab.get_by_role("button", name=button, exact=True).click()
        self.until(lambda: re.search(rf"{done}: (done|not done)\.", self.tab.inner_text("body")))
        assert f"{done}: done." in self.tab.inner_text("body")

    def picture(self, name: str) -> None:
        """Take a picture; it shows something, and is small enough for the documentation."""
        path = self._folder / name
        image = Image.open(io.BytesIO(self.tab.screenshot())).convert("RGB")
        assert len(np.unique(np.asarray(image).reshape(-1, 3), axis=0)) > 200
        image.save(path, optimize=True)
        assert path.stat().st_size < LARGEST


@pytest.mark.nightly("runs every node beside a browser for two minutes")
def test_a_hit_from_the_first_push_to_the_replay(
        start: Callable[..., Started], ros2: Callable[..., Any], open_tab: Callable[..., Any],
        tmp_path: Path) -> None:
    """The page shows the door open; the replay of the recording shows it before a reset."""
    folder = Path(os.environ.get("SCREENSHOTS", tmp_path))
    recording = tmp_path / "run.mcap"
    nodes = start("launch", "door_impact_bringup", "bringup.launch.yaml", "view:=true",
                  "view_port:=0", f"record:={recording}").wait_for_text("are shown at http")
    found = re.search(r"shown at (http://localhost:\d+)", nodes.text())
    assert found, nodes.text()
    page = Window(open_tab(found[1], SIZE), folder)
    page.until(lambda: re.search(r"door 0\.0 deg.*ZMP margin \d", page.tab.inner_text("body")))
    for notification in page.tab.locator(".mantine-Notification-closeButton").all():
        notification.click()  # there is no graphics card, says the page
    page.picture("standing.png")
    for impulse in IMPULSES:
        page.tab.get_by_label("impulse").fill(str(impulse))
        page.order("Push the door", f"Push the door with {impulse} N m s")
        page.until(lambda: page.door() > 1.0)
        page.until(lambda: page.door() < 0.05)
    page.order("Identify", "Identify the closer")
    page.order("Plan", "Plan a hit for 25.0 deg")
    page.tab.get_by_text("peak force").scroll_into_view_if_needed()
    page.picture("plan.png")
    page.tab.get_by_role("button", name="Hit", exact=True).click()
    page.until(lambda: page.door() > OPEN)
    page.picture("hit.png")
    page.until(lambda: "Hit the door: done." in page.tab.inner_text("body"))
    for button in ("Pause", "Step", "Go on"):  # one after the other: each is there when it can be
        page.order(button, button)
    page.order("Reset", "Reset the simulation")
    page.until(lambda: page.door() < 0.05)

    nodes.process.send_signal(signal.SIGINT)
    assert nodes.wait() == 0, nodes.text()
    made = ros2("run", "door_impact_evaluation", "report", str(recording))
    assert made.status == 0, made.err
    replay = Window(open_tab(recording.with_suffix(".html").as_uri(), SIZE, offline=True), folder)
    replay.until(lambda: replay.tab.evaluate("window.replay !== undefined"))
    replay.tab.keyboard.press("c")
    replay.until(lambda: "contact + 0.000 s" in replay.tab.inner_text("#phase"))
    replay.picture("replay.png")

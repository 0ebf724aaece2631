"""The view among the other nodes, which do not need it."""

import os
import re
import signal
import time
from collections.abc import Callable
from typing import Any

import pytest
from door_impact_bringup.up import answers
from door_impact_view.live import panels
from door_impact_view.live.page import Page
from impact_planner.task import settings
from page_client import PageClient
from processes import GUARD, Started

Start = Callable[..., Started]


def wait_for(launched: Started, pattern: str) -> str:
    """Wait for a line of the nodes, and return the group in it."""
    end = time.monotonic() + GUARD
    while (found := re.search(pattern, launched.text())) is None:
        assert launched.process.poll() is None, launched.text()
        assert time.monotonic() < end, launched.text()
        time.sleep(0.1)
    return found[1]


def test_the_page_offers_what_the_planner_knows() -> None:
    """The view does not import the planner; its choices are the planner's nevertheless."""
    assert tuple(settings.RUN_UPS) == panels.RUN_UPS
    assert tuple(settings.ENDINGS) == panels.ENDINGS


def test_whether_the_page_is_served_is_asked_without_an_error_of_its_server(
        caplog: pytest.LogCaptureFixture) -> None:
    page = Page("127.0.0.1", 0, lambda *_: None)
    assert answers(page.port)
    page.stop()
    assert not answers(page.port)
    assert caplog.messages == []


@pytest.mark.nightly("starts every node but the simulation")
def test_without_a_driver_the_page_shows_refusals_and_its_end_ends_no_other(
        start: Start, ros2: Callable[..., Any]) -> None:
    """What the planner refuses appears as its sentence, with the button to press first."""
    launched = start("launch", "door_impact_bringup", "bringup.launch.yaml", "driver:=none",
                     "view:=true", "view_port:=0")
    page = PageClient(int(wait_for(launched, r"shown at http://localhost:(\d+)")))
    page.until(lambda: page.has("Plan"), GUARD)

    def answer(button: str, wanted: str) -> None:
        end = time.monotonic() + GUARD
        while not any(wanted in text for _, text in page.notifications):  # servers start late
            assert time.monotonic() < end, page.notifications
            count = len(page.notifications)
            page.press(button)
            page.until(lambda count=count: len(page.notifications) > count, GUARD)

    answer("Plan", "nothing is known of the door: no message has arrived on /closer_parameters")
    answer("Plan", 'identify_closer (button "Identify") first')
    answer("Hit", "there is no plan yet")
    answer("Push the door", "No node that serves sim/push_door is running")
    assert page.disabled("Reset")
    assert "not done" in page.text()
    page.close()
    os.kill(int(wait_for(launched, r"\[door_impact_view-\d+\]: .*with pid \[(\d+)\]")),
            signal.SIGKILL)
    wait_for(launched, r"\[(door_impact_view-\d+)\]: process has died")
    end = time.monotonic() + GUARD
    while "/motion_server" not in (nodes := ros2("node", "list")).out:  # it starts late
        assert time.monotonic() < end, nodes
    assert launched.process.poll() is None
    assert "sending signal" not in launched.text()

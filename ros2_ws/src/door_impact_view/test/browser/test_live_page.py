"""The live page in a real browser: nothing hides the robot, and Stop is in sight."""

import pytest
from door_impact_view.live.page import Page

pytestmark = pytest.mark.nightly("starts a browser, which takes seconds and much memory")


@pytest.mark.parametrize(("width", "scheme"), [(390, "dark"), (800, "light"), (1400, "light")])
def test_the_panel_hides_no_robot_and_nothing_hides_stop(open_tab, width, scheme):
    """Picture and panel are beside each other; Stop can be pressed; the panel does not fold.

    The page is dark where the browser is.
    """
    given = []
    page = Page("127.0.0.1", 0, lambda order, reply: given.append(order.name))
    tab = open_tab(f"http://127.0.0.1:{page.port}", (width, 844), color_scheme=scheme)
    tab.locator(f"html[data-mantine-color-scheme={scheme}]").wait_for()
    plan = tab.get_by_role("button", name="Plan", exact=True)
    plan.wait_for()
    for close in tab.locator(".mantine-Notification-closeButton").all():
        close.click()  # there is no graphics card, says the page
    panel = plan.locator("xpath=ancestor::*[contains(@class, 'ScrollArea-root')][1]").bounding_box()
    picture = tab.locator("canvas").first.bounding_box()
    assert (picture["x"] + picture["width"] <= panel["x"] + 1.0
            or picture["y"] + picture["height"] <= panel["y"] + 1.0)
    assert min(picture["width"], picture["height"]) > 350.0
    title = tab.get_by_text("door impact").bounding_box()
    tab.mouse.click(title["x"] + 5.0, title["y"] + 5.0)  # would fold the panel of a narrow window
    tab.wait_for_timeout(500)
    tab.get_by_role("button", name="Stop", exact=True).click()
    for _ in range(100):
        tab.wait_for_timeout(0 if given else 100)
    assert (given, tab.title()) == (["stop"], "door impact")
    page.stop()

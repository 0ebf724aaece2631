"""Tests of the page with a client in place of a browser: address, orders and texts."""

import numpy as np
import pytest
from door_impact_view.errors import AddressError
from door_impact_view.live import panels
from door_impact_view.live.page import Page
from door_impact_view.live.state import Body, PlanSummary, State
from door_impact_view.scene.urdf import read_urdf
from hrp2_description.data import data_path
from page_client import PageClient

EVIL = '<img src=x onerror="alert(1)">{process.exit()}&'


@pytest.mark.parametrize("host", ["192.0.2.1", "a" * 70 + ".b"])  # RFC 5737: of no machine
def test_an_address_of_another_machine_is_refused(host):
    """In a sentence that names the parameter, instead of waiting for ever as viser does."""
    with pytest.raises(AddressError, match=f"view_host is {host}: "):
        Page(host, 8080, lambda order, reply: None)


def test_an_order_reaches_its_taker_and_every_browser_shows_the_answer():
    """Also when the browser that gave the order has gone meanwhile."""
    given = []
    page = Page("127.0.0.1", 0, lambda order, reply: given.append((order, reply)))
    first, second = PageClient(page.port), PageClient(page.port)
    for client in (first, second):
        client.until(lambda client=client: client.has("Push the door"))
    first.enter("impulse [N m s]", 9.5)
    first.press("Push the door")
    second.until(lambda: "Push the door with 9.5 N m s: waiting" in second.text())
    ((order, reply),) = given
    assert (order.name, order.fields) == ("push", {"impulse": 9.5})
    first.close()
    reply(True, "pushed")
    second.until(lambda: "done. pushed" in second.text() and second.notifications)
    assert second.notifications == [("Push the door with 9.5 N m s: done", "pushed")]
    second.close()
    page.stop()


SERVED = frozenset(panels.BUTTONS)
ROBOT = {"hit", "walk", "pass"}


@pytest.mark.parametrize(("state", "refused"), [
    (State(served=SERVED), {"hit"}),  # there is no plan
    (State(served=SERVED, plan=PlanSummary()), set()),
    (State(served=SERVED, plan=PlanSummary(), moving=frozenset({"walk"})), {"hit", "pass"}),
    (State(served=SERVED, plan=PlanSummary(), moving=frozenset({"hit"})), ROBOT),
    (State(served=SERVED - {"push", "reset"}, plan=PlanSummary()), {"push", "reset"}),
    (State(), SERVED - {"stop", "pause", "step"})])
def test_what_would_be_refused_is_disabled(state, refused):
    """A newer walk replaces the one under way; Stop can always be pressed."""
    assert set(panels.refusals(state)) == refused


def test_a_refusal_names_the_button_to_press():
    """Behind a service of any namespace; walk, hit and plan are English words as well."""
    assert panels.name_buttons("walk: call /a/plan_door_impact first", {
        "plan": "plan_door_impact", "walk": "walk"}) == (
        'walk: call /a/plan_door_impact (button "Plan") first')


def test_a_simulation_can_be_paused_and_stepped_and_a_robot_cannot():
    """Both buttons are there where a node serves them; Step, and Go on for Pause, in a pause."""
    page = Page("127.0.0.1", 0, lambda order, reply: None, plot_every=1)
    buttons = [page._panels._buttons[name] for name in ("pause", "step")]
    for state, shown in ((State(), [("Pause", False), ("Step", False)]),
                         (State(served=SERVED), [("Pause", True), ("Step", False)]),
                         (State(served=SERVED, paused=True), [("Go on", True), ("Step", True)])):
        page.draw(state)
        assert [(button.label, button.visible) for button in buttons] == shown
    page.stop()


def test_without_joint_angles_the_robot_is_in_its_zero_posture():
    """Each link's node is where the URDF's joint has it, not at its parent's origin."""
    page = Page("127.0.0.1", 0, lambda order, reply: None)
    client = PageClient(page.port)
    scene = read_urdf(data_path("urdf/hrp2.urdf").read_text(encoding="utf-8"))
    page.draw(State(robot=Body(scene=scene)))
    (knee,) = (joint for joint in scene.joints if joint.name == "RLEG_JOINT3")
    node = "/robot/visual/RLEG_LINK0/RLEG_LINK1/RLEG_LINK2/RLEG_LINK3"
    client.until(lambda: "position" in client.nodes.get(node, {}))
    assert client.nodes[node]["position"] == pytest.approx(knee.origin[:3, 3])
    client.close()
    page.stop()


def test_the_camera_follows_the_robot_as_long_as_it_is_to():
    """On the floor: not up and down."""
    page = Page("127.0.0.1", 0, lambda order, reply: None, plot_every=1)
    client = PageClient(page.port)
    client.until(lambda: page.watched and client.has("camera follows the robot"))
    x, y, z = page._server.initial_camera.position
    turn = np.array([1.0, 0.0, 0.0, 0.0])
    for place in ([0.5, 0.0, 0.7], [1.0, 0.3, 0.8]):
        page.draw(State(robot=Body(pose=(np.array(place), turn))))
    client.until(lambda: client.camera == pytest.approx((x + 1.0, y + 0.3, z)))
    client.enter("camera follows the robot", False)
    client.until(lambda: not page._follows.value)
    page.draw(State(robot=Body(pose=(np.array([5.0, 0.3, 0.7]), turn)), phase="walk"))
    client.until(lambda: "walk" in client.text())
    assert client.camera == pytest.approx((x + 1.0, y + 0.3, z))
    client.close()
    page.stop()


def test_a_click_on_the_floor_is_a_goal_for_walk():
    """Its turn stays; a click above the horizon is none."""
    given = []
    page = Page("127.0.0.1", 0, lambda order, reply: given.append(order.fields))
    client = PageClient(page.port)
    client.until(lambda: page.watched and client.has("Walk"))
    client.enter("x, y [m], turn [deg]", (0.0, 0.0, 90.0))
    client.click((2.0, 1.0, 1.5), (-0.4, 0.2, -1.0))
    client.until(lambda: client.nodes["/goal"].get("position") == pytest.approx((1.4, 1.3, 0.0)))
    client.click((2.0, 1.0, 1.5), (-0.4, 0.2, 0.1))
    client.press("Walk")
    client.until(lambda: given)
    assert given == [{"x": 1.4, "y": 1.3, "turn": 90.0}]
    client.close()
    page.stop()


def test_texts_of_nodes_are_shown_and_never_run():
    """A plan or a state with HTML in it appears as text."""
    plan = PlanSummary(((EVIL, EVIL),), ((EVIL, 0.01),), (EVIL,))
    for html in (panels.plan_html(plan), panels.answer_html("Run", EVIL, False),
                 panels.state_html(State(phase=EVIL, door=Body(problem=EVIL)))):
        assert "<img" not in html
        assert "&lt;img src=x onerror=&quot;alert(1)&quot;&gt;" in html

"""The node door_impact_view beside other nodes over DDS, with a client in place of a browser."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from door_impact_common.errors import DoorImpactError
from door_impact_common.stamps import stamp_of
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan, PhaseMargin
from door_impact_msgs.srv import PlanDoorImpact
from door_impact_view.ros import door_impact_view_node as module
from geometry_msgs.msg import Point32, PointStamped, PolygonStamped, TransformStamped, WrenchStamped
from hrp2_description.data import data_path
from rclpy.action import ActionServer
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

HRP2 = data_path("urdf/hrp2.urdf").read_text(encoding="utf-8")
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def publish_motion(node: Any) -> Callable[[float], None]:
    """Return a function that publishes all that moves, with a door angle [rad]."""
    topics = {"/joint_states": JointState, "/door_angle": JointState, "/zmp": PointStamped,
              "/com": PointStamped, "/support_polygon": PolygonStamped, "/tf": TFMessage}
    publishers = {name: node.create_publisher(kind, name, 10) for name, kind in topics.items()}
    now = [0]

    def publish(angle: float) -> None:
        now[0] += 20_000_000
        stamp = stamp_of(now[0])
        joints = JointState(name=["RLEG_JOINT3"], position=[0.5])
        door = JointState(name=["door_hinge"], position=[angle])
        zmp, com, polygon = PointStamped(), PointStamped(), PolygonStamped()
        zmp.point.x, com.point.x, com.point.z = 0.01, 0.02, 0.8
        polygon.polygon.points = [
            Point32(x=x, y=y) for x, y in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))]
        base = TransformStamped()
        base.header.frame_id, base.child_frame_id = "odom", "base_link"
        base.transform.translation.z, base.transform.rotation.w = 0.65, 1.0
        other = TransformStamped()  # of something that is neither robot nor door
        other.header.frame_id, other.child_frame_id = "odom", "camera"
        other.transform.translation.z, other.transform.rotation.w = 9.0, 1.0
        for name, message in {"/joint_states": joints, "/door_angle": door, "/zmp": zmp,
                              "/com": com, "/support_polygon": polygon}.items():
            message.header.stamp = stamp
            publishers[name].publish(message)
        for transform in (base, other):
            publishers["/tf"].publish(TFMessage(transforms=[transform]))

    return publish


def test_robot_and_points_move_as_the_topics_say(rig: Any) -> None:
    """Joints, base, ZMP, CoM and capture point of the page are those of the topics."""
    with rig() as r:
        description = r.other.create_publisher(String, "/robot_description", LATCHED)
        description.publish(String(data=HRP2))
        publish = publish_motion(r.other)
        page = r.open_page()
        knee = ("/robot/base_link/RLEG_LINK0/RLEG_LINK1/RLEG_LINK2/RLEG_LINK3")
        r.until(lambda: page.nodes.get("/balance/capture_point", {}).get("visible")
                and "wxyz" in page.nodes.get(knee, {}), lambda: publish(0.1))
        assert page.nodes[knee]["wxyz"] == pytest.approx([math.cos(0.25), 0, math.sin(0.25), 0])
        assert page.nodes["/robot/base_link"]["position"] == pytest.approx([0, 0, 0.65])
        assert page.nodes["/balance/com"]["position"] == pytest.approx([0.02, 0, 0.8])
        assert page.nodes["/balance/zmp"]["position"][:2] == pytest.approx([0.01, 0])
        r.until(lambda: "ZMP margin 90 mm" in page.text(), lambda: publish(0.1))


def test_a_hands_force_appears_as_arrow_and_curve(rig: Any) -> None:
    """In the wrist's frame, 1 mm for each newton, ending at the wrist; the plot shows its size."""
    with rig() as r:
        description = r.other.create_publisher(String, "/robot_description", LATCHED)
        description.publish(String(data=HRP2))
        wrists = {side: r.other.create_publisher(WrenchStamped, f"/{side}_wrist/wrench", 10)
                  for side in ("right", "left")}
        now = [0]

        def publish() -> None:
            now[0] += 20_000_000
            for side, link, force in (("right", "RARM_LINK5", 120.0), ("left", "LARM_LINK5", 2.0)):
                message = WrenchStamped()
                message.header.frame_id, message.header.stamp = link, stamp_of(now[0])
                message.wrench.force.y, message.wrench.force.z = force, -1.25 * force
                wrists[side].publish(message)

        def arrow(link: str) -> dict[str, Any]:
            return next((node for name, node in page.nodes.items()
                         if name.endswith(f"/{link}/force")), {})

        page = r.open_page()
        r.until(lambda: arrow("RARM_LINK5").get("visible"), publish)
        r.until(lambda: arrow("RARM_LINK5").get("updates"), publish)
        points = arrow("RARM_LINK5")["updates"]["points"].reshape(2, 3)
        np.testing.assert_allclose(points, [[0.0, -0.12, 0.15], [0.0, 0.0, 0.0]], atol=1e-6)
        assert not arrow("LARM_LINK5").get("visible")  # too small to be told from noise

        def hands() -> dict[str, Any]:
            return next((item for item in page.elements.values()
                         if item.get("title") == "force on the hands [N]"), {})

        def size() -> float:
            curves = dict(zip([row["label"] for row in hands().get("series", [])],
                              hands().get("data", []), strict=False))
            values = curves.get("RARM_LINK5", ())
            return float(values[-1]) if len(values) else 0.0

        r.until(lambda: size() == pytest.approx(math.hypot(120.0, 150.0)), publish)


def test_a_late_tick_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ticks that last longer than the period are not made up for afterwards."""
    clock, begun = [0.0], []

    class Slow:
        period = 0.05

        def tick(self) -> None:
            begun.append(clock[0])
            clock[0] += 0.12 if len(begun) == 3 else 0.01
            if len(begun) == 6:
                raise KeyboardInterrupt

    monkeypatch.setattr(module.rclpy, "ok", lambda: True)
    monkeypatch.setattr(module.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(module.time, "sleep", lambda pause: clock.__setitem__(0, clock[0] + pause))
    with pytest.raises(KeyboardInterrupt):
        module.run(Slow())
    np.testing.assert_allclose(begun, [0.0, 0.05, 0.1, 0.25, 0.3, 0.35], atol=1e-9)


def test_a_slow_view_reads_the_last_message_and_delays_no_publisher(rig: Any) -> None:
    """Of five hundred messages between two ticks it shows the newest one."""
    with rig() as r:
        angles = r.other.create_publisher(JointState, "/door_angle", 10)
        page = r.open_page()
        r.until(angles.get_subscription_count)
        for number in range(500):
            message = JointState(name=["door_hinge"], position=[1e-3 * number])
            message.header.stamp = stamp_of(1_000_000 * (number + 1))
            angles.publish(message)
        r.until(lambda: r.view._watcher.state.door_angle is not None)
        assert r.view._watcher.state.door_angle.value[0] == pytest.approx(0.499)
        r.until(lambda: "door 28.6 deg" in page.text())


def test_without_a_browser_nothing_is_subscribed(rig: Any) -> None:
    """The graph sends the view nothing before a browser comes and after the last one has left."""
    with rig() as r:
        zmp = r.other.create_publisher(PointStamped, "/zmp", 10)
        for _ in range(5):
            r.view.tick()
        assert not r.view.count_subscribers("/zmp")
        page = r.open_page()
        r.until(lambda: zmp.get_subscription_count() == 1)
        r.pages.remove(page)
        page.close()
        r.until(lambda: zmp.get_subscription_count() == 0)


def test_a_refusal_appears_as_the_nodes_sentence(rig: Any) -> None:
    """The button Plan asks the service with the numbers of the panel, and shows its sentence."""
    asked = []

    def refuse(request: Any, response: Any) -> Any:
        asked.append(request)
        response.success, response.message = False, "no such angle: 35 deg is above <30> {deg}"
        return response

    with rig() as r:
        r.other.create_service(PlanDoorImpact, "/plan_door_impact", refuse)
        page = r.open_page()
        r.until(lambda: page.has("Plan") and r.view.count_services("/plan_door_impact"))
        page.enter("angle [deg]", 35.0)
        page.enter("ending", "retreat")
        page.press("Plan")
        r.until(lambda: page.notifications and "not done" in page.text())
    (request,) = asked
    assert request.desired_opening_angle == pytest.approx(math.radians(35.0))
    assert (request.run_up, request.ending) == ("", "retreat")
    assert page.notifications[-1] == (
        "Plan a hit for 35.0 deg: not done", "no such angle: 35 deg is above <30> {deg}")
    assert "35 deg is above &lt;30&gt; {deg}" in page.text()


@pytest.mark.parametrize(("button", "name"), [
    ("Push the door", "/sim/push_door"), ("Identify", "/identify_closer"),
    ("Plan", "/plan_door_impact"), ("Run", "/execute_door_impact"), ("Stop", "/stop"),
    ("Reset", "/sim/reset")])
def test_a_button_says_which_server_is_missing(rig: Any, button: str, name: str) -> None:
    """Where nothing answers, as with driver:=none, the button names what is not there."""
    with rig() as r:
        page = r.open_page()
        r.until(lambda: page.has(button))
        page.press(button)
        r.until(lambda: page.notifications)
    assert f"{name} is not there" in page.notifications[-1][1]


def test_a_plan_is_shown_with_margins_and_warnings(rig: Any) -> None:
    """A plan that anybody made appears on the page."""
    with rig() as r:
        plans = r.other.create_publisher(ImpactPlan, "/door_impact_plan", LATCHED)
        plans.publish(ImpactPlan(
            plan_id="p7", v_rb=0.4164, zmp_margins=[PhaseMargin(phase="cam", margin=-0.0123)],
            warnings=["it is close"]))
        page = r.open_page()
        r.until(lambda: "p7" in page.text())
    for text in ("0.416 m/s", "ZMP margin, cam", "-12.3 mm", "Warning: it is close"):
        assert text in page.text()


def test_run_shows_phases_and_the_result(rig: Any) -> None:
    """Feedback of the action appears as the phase, and its result as a sentence."""

    def execute(goal: Any) -> Any:
        feedback = ExecuteDoorImpact.Feedback(phase="cam", progress=0.5)
        for _ in range(40):
            goal.publish_feedback(feedback)
            r.view.tick()
            for page in r.pages:
                page.read(timeout=0.005)
            seen.append("cam, 50 %" in page.text())
        goal.abort()
        return ExecuteDoorImpact.Result(success=False, message="the door was not there")

    seen: list[bool] = []
    with rig() as r:
        server = ActionServer(r.other, ExecuteDoorImpact, "/execute_door_impact", execute)
        page = r.open_page()
        r.until(lambda: page.has("Run") and r.view.count_services(
            "/execute_door_impact/_action/send_goal"))
        page.press("Run")
        r.until(lambda: page.notifications)
        r.until(lambda: "no motion" in page.text())
        server.destroy()
    assert any(seen)
    assert page.notifications[-1][1] == "the door was not there"


def test_bad_messages_do_not_end_the_view(rig: Any) -> None:
    """A URDF that is none, NaN and missing positions: the page says so and goes on."""
    with rig() as r:
        description = r.other.create_publisher(String, "/robot_description", LATCHED)
        description.publish(String(data="<robot"))
        joints = r.other.create_publisher(JointState, "/joint_states", 10)
        com = r.other.create_publisher(PointStamped, "/com", 10)
        bad = PointStamped()
        bad.point.x = math.nan
        page = r.open_page()

        def publish() -> None:
            joints.publish(JointState(name=["a", "b"], position=[math.nan]))
            com.publish(bad)

        r.until(lambda: "the URDF cannot be drawn" in page.text(), publish)
        description.publish(String(data=HRP2))
        r.until(lambda: "/robot/base_link" in page.nodes
                and "the URDF cannot be drawn" not in page.text(), publish)
        assert not r.view.failures


def test_a_page_for_other_machines_only_shows(rig: Any) -> None:
    """Without a token there is no button; with one it appears after the token was entered."""
    with rig(view_host="0.0.0.0") as r:
        page = r.open_page()
        r.until(lambda: "only shows" in page.text())
        assert not page.has("Plan")
        assert not page.has("view_token")
    with rig(view_host="0.0.0.0", view_token="s3cret") as r:
        page = r.open_page()
        r.until(lambda: page.has("view_token"))
        assert not page.has("Plan")
        page.enter("view_token", "guess")
        page.press("Unlock the buttons")
        r.until(lambda: page.notifications)
        assert "not the view_token" in page.notifications[-1][1]
        assert not page.has("Plan")
        page.enter("view_token", "s3cret")

        def again() -> None:  # right after a wrong token none is taken
            if page.has("Unlock the buttons"):
                page.press("Unlock the buttons")

        r.until(lambda: page.has("Plan"), again)
        other = r.open_page()
        r.until(lambda: other.has("view_token"))
        assert not other.has("Plan")


def test_after_a_reset_of_the_clock_everything_is_shown_again(rig: Any) -> None:
    """What was published before the reset and never again hides nothing."""
    with rig() as r:
        description = r.other.create_publisher(String, "/robot_description", LATCHED)
        description.publish(String(data=HRP2))
        late = WrenchStamped()
        late.header.frame_id, late.header.stamp = "l_sole", stamp_of(10**18)
        foot = r.other.create_publisher(WrenchStamped, "/left_foot/wrench", 10)
        page = r.open_page()
        r.until(foot.get_subscription_count)
        foot.publish(late)
        r.until(lambda: r.view._watcher.state.forces)
        publish = publish_motion(r.other)
        r.until(lambda: page.nodes.get("/balance/zmp", {}).get("visible"), lambda: publish(0.0))


@pytest.mark.parametrize(("name", "value"), [
    ("view_token", "0123"), ("view_rate", 0.0), ("view_port", -1), ("view_port", 1.5),
    ("view_host", "192.0.2.1")])
def test_a_bad_parameter_is_refused_by_its_name(rig: Any, name: str, value: Any) -> None:
    """A token that is read as a number too: what is typed in the browser would never be equal."""
    with pytest.raises(DoorImpactError, match=name), rig(**{name: value}):
        pass


def test_the_door_stands_in_its_place_whatever_comes_first(rig: Any) -> None:
    """Its place, which is published once, may come before its description."""
    with rig() as r:
        static = r.other.create_publisher(TFMessage, "/tf_static", LATCHED)
        place = TransformStamped()
        place.header.frame_id, place.child_frame_id = "odom", "door_frame"
        place.transform.translation.y, place.transform.rotation.w = -0.738, 1.0
        static.publish(TFMessage(transforms=[place]))
        page = r.open_page()
        r.until(static.get_subscription_count)
        for _ in range(20):
            r.until(lambda: True)
            r.view.tick()
        door = r.other.create_publisher(String, "/door_description", LATCHED)
        door.publish(String(data='<robot name="d"><link name="door_frame"/></robot>'))
        r.until(lambda: page.nodes.get("/door/door_frame", {}).get("position") == [0, -0.738, 0])

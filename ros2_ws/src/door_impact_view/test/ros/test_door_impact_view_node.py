"""The node door_impact_view beside other nodes over DDS, with a client in place of a browser."""

import math
from collections.abc import Callable
from typing import Any

import pytest
from door_impact_common.errors import DoorImpactError
from door_impact_common.stamps import stamp_of
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.srv import PlanDoorImpact
from geometry_msgs.msg import Point32, PointStamped, PolygonStamped, TransformStamped
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
        base = "/robot/base_link"
        knee = f"{base}/RLEG_LINK0/RLEG_LINK1/RLEG_LINK2/RLEG_LINK3"
        moved = (base, "/balance/com", "/balance/zmp")
        r.until(lambda: page.nodes.get("/balance/capture_point", {}).get("visible")
                and "wxyz" in page.nodes.get(knee, {})
                and all("position" in page.nodes.get(name, {}) for name in moved),
                lambda: publish(0.1))
        assert page.nodes[knee]["wxyz"] == pytest.approx([math.cos(0.25), 0, math.sin(0.25), 0])
        assert page.nodes[base]["position"] == pytest.approx([0, 0, 0.65])
        assert page.nodes["/balance/com"]["position"] == pytest.approx([0.02, 0, 0.8])
        assert page.nodes["/balance/zmp"]["position"][:2] == pytest.approx([0.01, 0])
        r.until(lambda: "ZMP margin 90 mm" in page.text(), lambda: publish(0.1))


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


def test_a_button_says_which_server_is_missing(rig: Any) -> None:
    """Where nothing answers, as with driver:=none, the button names what is not there."""
    with rig() as r:
        page = r.open_page()
        r.until(lambda: page.has("Run"))
        page.press("Run")
        r.until(lambda: page.notifications)
    assert "/execute_door_impact" in page.notifications[-1][1]


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


@pytest.mark.parametrize(("name", "value"), [("view_token", "0123"), ("view_rate", 0.0)])
def test_a_bad_parameter_is_refused_by_its_name(rig: Any, name: str, value: Any) -> None:
    """A token that is read as a number too: what is typed in the browser would never be equal."""
    with pytest.raises(DoorImpactError, match=name), rig(**{name: value}):
        pass

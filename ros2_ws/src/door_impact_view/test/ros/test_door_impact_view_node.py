"""The node door_impact_view beside other nodes over DDS, with a client in place of a browser."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any

import pytest
import rclpy
from door_impact_common.node import executor_of, spin_for
from door_impact_common.stamps import stamp_of
from door_impact_msgs.action import Walk
from door_impact_msgs.srv import PlanDoorImpact
from door_impact_view.ros.door_impact_view_node import DoorImpactView
from geometry_msgs.msg import Point32, PointStamped, PolygonStamped, TransformStamped
from hrp2_description.data import data_path
from page_client import PageClient
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

HRP2 = data_path("urdf/hrp2.urdf").read_text(encoding="utf-8")
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Rig:
    """The view, a node that plays the rest of the graph, and a client of the page."""

    def __init__(self) -> None:
        self.view, self.other = DoorImpactView(), rclpy.create_node("other")
        self.view_executor = executor_of(self.view)  # as in the node's own process
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.other)
        self.page: PageClient | None = None

    def open_page(self) -> PageClient:
        """A browser."""
        self.page = PageClient(self.view.page.port)
        return self.page

    def turn(self) -> None:
        """Run what has work now."""
        for _ in range(5):
            self.executor.spin_once(timeout_sec=0.0)
        spin_for(self.view_executor, 0.0)
        self.view.tick()
        if self.page is not None:
            self.page.read(timeout=0.005)

    def until(self, done: Callable[[], Any], each: Callable[[], Any] = lambda: None) -> None:
        """Run everything until a condition holds."""
        limit = time.monotonic() + 60.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            each()
            self.turn()


@contextmanager
def rig(*arguments: str) -> Iterator[Rig]:
    """A rig whose page is on any free port; all its nodes get the arguments."""
    rclpy.init(args=["--ros-args", "-p", "view_port:=0", *arguments])
    try:
        made = Rig()
        yield made
        if made.page is not None:
            made.page.close()
        made.view_executor.shutdown()
        made.view.destroy_node()
        made.executor.shutdown()
        made.other.destroy_node()
    finally:
        rclpy.shutdown()


def publish_motion(node: Any, prefix: str = "") -> Callable[[float], None]:
    """Return a function that publishes all that moves, with a door angle [rad]."""
    topics = {"joint_states": JointState, "imu": Imu, "door_angle": JointState, "zmp": PointStamped,
              "com": PointStamped, "support_polygon": PolygonStamped, "/tf": TFMessage}
    publishers = {name: node.create_publisher(kind, name, 10) for name, kind in topics.items()}
    stamps = count(20_000_000, 20_000_000)

    def publish(angle: float) -> None:
        stamp = stamp_of(next(stamps))
        joints = JointState(name=["RLEG_JOINT3"], position=[0.5])
        door = JointState(name=["door_hinge"], position=[angle])
        zmp, com, polygon = PointStamped(), PointStamped(), PolygonStamped()
        zmp.point.x, com.point.x, com.point.z = 0.01, 0.02, 0.8
        polygon.polygon.points = [
            Point32(x=x, y=y) for x, y in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))]
        base = TransformStamped()
        base.header.frame_id, base.child_frame_id = f"{prefix}odom", f"{prefix}base_link"
        base.transform.translation.z, base.transform.rotation.w = 0.65, 1.0
        for name, message in {"joint_states": joints, "imu": Imu(), "door_angle": door, "zmp": zmp,
                              "com": com, "support_polygon": polygon}.items():
            message.header.stamp = stamp
            publishers[name].publish(message)
        publishers["/tf"].publish(TFMessage(transforms=[base]))

    return publish


@pytest.mark.parametrize(("prefix", "arguments"), [
    ("", ()), ("robot1/", ("-r", "__ns:=/robot1", "-p", "frame_prefix:=robot1/"))])
def test_robot_and_points_move_as_the_topics_say(prefix: str, arguments: tuple[str, ...]) -> None:
    """Joints, base, ZMP, CoM and capture point of the page are those of its namespace's topics."""
    with rig(*arguments) as r:
        description = r.other.create_publisher(String, "robot_description", LATCHED)
        description.publish(String(data=HRP2))
        r.other.create_publisher(Bool, "sim/paused", LATCHED).publish(Bool(data=True))
        publish = publish_motion(r.other, prefix)
        page = r.open_page()
        base = "/robot"
        knee = f"{base}/visual/RLEG_LINK0/RLEG_LINK1/RLEG_LINK2/RLEG_LINK3"
        moved = (base, "/balance/com", "/balance/zmp")
        r.until(lambda: page.nodes.get("/balance/capture_point", {}).get("visible")
                and page.nodes.get(knee, {}).get("wxyz", (1,))[0] < 0.99
                and all("position" in page.nodes.get(name, {}) for name in moved),
                lambda: publish(0.1))
        assert page.nodes[knee]["wxyz"] == pytest.approx([math.cos(0.25), 0, math.sin(0.25), 0])
        assert page.nodes[base]["position"] == pytest.approx([0, 0, 0.65])
        assert page.nodes["/balance/com"]["position"] == pytest.approx([0.02, 0, 0.8])
        assert page.nodes["/balance/zmp"]["position"][:2] == pytest.approx([0.01, 0])
        r.until(lambda: "ZMP margin 90 mm" in page.text() and "paused" in page.text()
                and page.has("also plot"), lambda: publish(0.1))
        page.enter("also plot", "IMU: specific force [m/s²]")
        r.until(lambda: any(each.get("title") == "IMU: specific force [m/s²]"
                            for each in page.elements.values()), lambda: publish(0.1))


def test_without_a_browser_nothing_is_subscribed() -> None:
    """The view asks for no messages before a browser comes and after the last one has left."""
    with rig() as r:

        def heard() -> bool:
            return any(each.topic_name == "/zmp" for each in r.view.subscriptions)

        r.turn()
        assert not heard()
        page = r.open_page()
        r.until(heard)
        r.page = None
        page.close()
        r.until(lambda: not heard())


def test_a_refusal_appears_as_a_sentence() -> None:
    """The service is asked with the numbers of the panel; a server that is not there is named."""
    asked = []

    def refuse(request: Any, response: Any) -> Any:
        asked.append(request)
        response.success, response.message = False, "no such angle: 35 deg is above <30> {deg}"
        return response

    with rig() as r:
        r.other.create_service(PlanDoorImpact, "plan_door_impact", refuse)
        page = r.open_page()
        r.until(lambda: page.has("Plan") and r.view.count_services("plan_door_impact"))
        page.press("Hit")
        r.until(lambda: any("execute_door_impact" in text for _, text in page.notifications))
        page.enter("angle [deg]", 35.0)
        page.enter("ending", "retreat")
        page.press("Plan")
        r.until(lambda: len(page.notifications) == 2
                and "35 deg is above &lt;30&gt; {deg}" in page.text())
    (request,) = asked
    assert request.desired_opening_angle == pytest.approx(math.radians(35.0))
    assert (request.run_up, request.ending) == ("", "retreat")
    assert page.notifications[-1] == (
        "Plan a hit for 35.0 deg: not done", "no such angle: 35 deg is above <30> {deg}")


def test_a_motion_is_shown_whoever_wants_it() -> None:
    """Phase, footsteps and disabled buttons follow a goal from elsewhere, also one that is older.

    Footsteps of an older walk are not drawn.
    """

    async def execute(goal: Any) -> Any:
        goals.append(goal)
        await ended
        goal.succeed()
        return Walk.Result(success=True)

    goals: list[Any] = []
    ended = Future()
    with rig() as r:
        server = ActionServer(r.other, Walk, "walk", execute)
        client = ActionClient(r.other, Walk, "walk")
        markers = r.other.create_publisher(MarkerArray, "footstep_markers", LATCHED)

        def step(x: float, stamp: Any) -> None:
            sole = Marker(type=Marker.CUBE)
            sole.header.stamp, sole.pose.position.x, sole.scale.x = stamp, x, 0.2
            markers.publish(MarkerArray(markers=[Marker(action=Marker.DELETEALL), sole]))

        step(9.0, stamp_of(1))
        r.until(client.server_is_ready)
        client.send_goal_async(Walk.Goal())
        r.until(lambda: goals)
        page = r.open_page()
        r.until(lambda: "walk: is being prepared" in page.text())
        assert not page.nodes["/footsteps"].get("visible")
        step(1.0, r.other.get_clock().now().to_msg())
        r.until(lambda: "walk: step 2 of 5" in page.text() and page.nodes["/footsteps"]["visible"],
                lambda: goals[0].publish_feedback(Walk.Feedback(step=2, steps=5)))
        assert not page.disabled("Walk")  # a newer goal replaces the older one
        assert page.disabled("Hit")
        ended.set_result(None)
        r.until(lambda: "no motion" in page.text() and not page.nodes["/footsteps"]["visible"])
        ended = Future()
        client.send_goal_async(Walk.Goal())
        r.until(lambda: "walk: " in page.text())
        server.destroy()
        r.until(lambda: "no motion" in page.text())
        client.destroy()


def test_walk_asks_for_the_goal_of_the_panel() -> None:
    """And its result appears as a sentence."""
    goals = []

    def execute(goal: Any) -> Any:
        goals.append(goal.request.goal.pose)
        goal.abort()
        return Walk.Result(success=False, message="the door is in the way")

    with rig() as r:
        server = ActionServer(r.other, Walk, "walk", execute)
        page = r.open_page()
        r.until(lambda: page.has("Walk") and not page.disabled("Walk"))
        page.enter("x, y [m], turn [deg]", (1.0, -0.5, 90.0))
        page.press("Walk")
        r.until(lambda: page.notifications)
        server.destroy()
    assert page.notifications[-1] == (
        "Walk to x 1.00 m, y -0.50 m, turn 90 deg: not done", "the door is in the way")
    ((pose,),) = (goals,)
    assert (pose.position.x, pose.position.y) == (1.0, -0.5)
    assert (pose.orientation.z, pose.orientation.w) == pytest.approx((0.5**0.5, 0.5**0.5))


def test_bad_messages_do_not_end_the_view() -> None:
    """A URDF that is none, NaN and missing positions: the page says so and goes on."""
    with rig() as r:
        description = r.other.create_publisher(String, "robot_description", LATCHED)
        description.publish(String(data="<robot"))
        joints = r.other.create_publisher(JointState, "joint_states", 10)
        com = r.other.create_publisher(PointStamped, "com", 10)
        bad = PointStamped()
        bad.point.x = math.nan
        page = r.open_page()

        def publish() -> None:
            joints.publish(JointState(name=["a", "b"], position=[math.nan]))
            com.publish(bad)

        r.until(lambda: "the URDF cannot be drawn" in page.text(), publish)
        description.publish(String(data=HRP2))
        r.until(lambda: any(name.endswith("/RLEG_LINK0") for name in page.nodes)
                and "the URDF cannot be drawn" not in page.text(), publish)
        assert not r.view.failures

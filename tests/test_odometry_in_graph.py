"""The odometry over topics, from simulation and `zmp_publisher`: a start, a walk, a reset."""

import math
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from door_impact_common.driver.messages import trajectory_message
from door_impact_common.stamps import nanoseconds
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from processes import Started, find_ros2
from rclpy.context import Context
from running_graph import Graph
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory
from walking.footsteps.footstep import Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.pattern.plan import plan_walk
from walking.pattern.state import standing

START = Pose(6.0, -4.0, 2.0)
WALK = Pose(0.3, 0.1, math.radians(20.0))  # from the start


@pytest.fixture
def graph(tmp_path: Path) -> Iterator[Graph]:
    """Simulation and zmp_publisher, which begin at START."""
    start = f"robot_start:=[{START.x}, {START.y}, {START.yaw}]"
    nodes = [
        Started([find_ros2(), "run", package, package, "--ros-args", "-p", start, *arguments],
                tmp_path / f"{package}.txt")
        for package, arguments in (
            ("hrp2_sim_bridge", ["-p", "engine:=mujoco", "-p", "door_distance:=9.0",
                                 "-p", "hinge_x:=-9.0"]),
            ("zmp_publisher", ["-p", "use_sim_time:=true"]))]
    context = Context()
    rclpy.init(args=[], context=context)
    try:
        yield Graph(*nodes, context=context)
    finally:
        for node in nodes:
            node.process.send_signal(signal.SIGINT)
            node.wait()
            node.clean_up()
        rclpy.try_shutdown(context=context)


def base(message: TFMessage) -> Pose | None:
    """The pose of base_link on the floor, in odom."""
    for transform in message.transforms:
        if (transform.header.frame_id, transform.child_frame_id) == ("odom", "base_link"):
            to, turn = transform.transform.translation, transform.transform.rotation
            yaw = math.atan2(2.0 * (turn.w * turn.z + turn.x * turn.y),
                             1.0 - 2.0 * (turn.y**2 + turn.z**2))
            return Pose(to.x, to.y, yaw)
    return None


def wait_for(graph: Graph, wanted: Pose, since: float = 0.0) -> None:
    """Wait until base_link is near a pose, in a message after a time [s]."""
    def there(messages: list[TFMessage]) -> bool:
        found = base(messages[-1])
        time = 1e-9 * nanoseconds(messages[-1].transforms[0].header.stamp)
        return time > since and found is not None and (
            math.hypot(found.x - wanted.x, found.y - wanted.y) < 0.02
            and abs(math.remainder(found.yaw - wanted.yaw, math.tau)) < 0.02)

    graph.listen(TFMessage, "/tf", there)


@pytest.mark.nightly("a walk in a graph of its own")
def test_a_walk_from_a_start_elsewhere_and_a_reset(graph: Graph) -> None:
    """/tf begins at `robot_start`, ends where the walk leads, and begins there anew by a reset."""
    model = RobotModel(load_robot_config())
    stance = Stance.around(Pose(0.0, 0.0, 0.0), model.config.footsteps.width)
    plan = plan_walk(model, standing(model, stance), plan_footsteps(model.config, stance, WALK))
    middle = plan.stance.middle
    goal = START.moved(middle.x, middle.y, middle.yaw)
    wait_for(graph, START)

    message = trajectory_message(plan.knots, model.joint_names)
    publisher = graph.node.create_publisher(JointTrajectory, "/joint_trajectory", 1)
    graph.spin_until(publisher.get_subscription_count, "the driver")
    publisher.publish(message)
    wait_for(graph, goal, since=plan.duration)

    def uses_imu(messages: list[Any]) -> bool:
        return any(pair.key == "odometry" and pair.value == "soles and imu"
                   for each in messages for status in each.status for pair in status.values)

    graph.listen(DiagnosticArray, "/diagnostics", uses_imu)
    assert graph.call(Trigger, "/sim/reset").success
    wait_for(graph, START)

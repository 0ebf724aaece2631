"""The manners of the robot's driver over its topics: what it refuses, a fall, a reset."""

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from door_impact_msgs.srv import PushDoor, PushRobot
from geometry_msgs.msg import PointStamped, Vector3
from hrp2_description.robot import load_robot_config
from processes import parameters
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from graph.test_walk import Result, to, walker

# A joint that moves less stands still [rad]: sensor noise makes the stabilizer move an ankle by
# up to 4.8 mrad.
STILL = 6e-3
ROBOT = load_robot_config()
HEAD = ROBOT.index("HEAD_JOINT0")


@pytest.fixture(scope="module")
def send(graph: Any) -> Callable[..., None]:
    """Publishes a trajectory to one posture after a time [s]; its stamp is 0 for now [s]."""
    publisher = graph.node.create_publisher(JointTrajectory, "/joint_trajectory", 10)

    def publish(at: float, position: Any, stamp: int = 0) -> None:
        point = JointTrajectoryPoint(positions=list(position))
        point.time_from_start.sec, point.time_from_start.nanosec = int(at), round(at % 1.0 * 1e9)
        message = JointTrajectory(joint_names=list(ROBOT.joint_names), points=[point])
        message.header.stamp.sec = stamp
        publisher.publish(message)

    return publish


def driver(graph: Any, told: Callable[[dict[str, str]], bool],
           again: Callable[[], Any] = lambda: None) -> dict[str, str]:
    """The driver's diagnostics once they tell something; `again` is done until they do.

    A new publisher may be unknown to the driver for a while.
    """
    found: list[dict[str, str]] = []

    def telling(heard: list[DiagnosticArray]) -> bool:
        for status in heard[-1].status:
            if status.name == "hrp2_sim_bridge: driver":
                found.append({"message": status.message} | {v.key: v.value for v in status.values})
                if told(found[-1]):
                    return True
                again()
        return False

    graph.listen(DiagnosticArray, "/diagnostics", telling)
    return found[-1]


@pytest.mark.parametrize(("at", "turn", "ahead", "words"), [
    (1.0, math.nan, False, "HEAD_JOINT0: position"), (0.0, 0.2, False, "HEAD_JOINT0: jump"),
    (1.0, 0.0, True, "use_sim_time")], ids=["NaN", "jump", "another clock"])
def test_bad_trajectories_move_nothing_and_are_reported(
        graph: Any, send: Callable[..., None], at: float, turn: float, ahead: bool,
        words: str) -> None:
    """/diagnostics counts them and names the joint, or the sender's clock, decades ahead."""
    rest = np.array(graph.last(JointState, "/joint_states").position)
    goal = rest.copy()
    goal[HEAD] += turn
    count = int(driver(graph, lambda s: True)["refused"])
    told = driver(graph, lambda s: int(s["refused"]) > count and words in s["last_refusal"],
                  lambda: send(at, goal, int(time.time()) if ahead else 0))
    assert "refused" in told["message"]
    heard = graph.listen(JointState, "/joint_states", lambda got: len(got) > 250)
    assert max(np.abs(m.position - rest).max() for m in heard) < STILL


def test_a_good_trajectory_moves_the_joint_it_names(
        graph: Any, send: Callable[..., None]) -> None:
    """The counterpart of the refusals: the head turns by 0.1 rad, and nothing else moves."""
    turn = ROBOT.posture({"HEAD_JOINT0": 0.1}) - ROBOT.posture({})
    wanted = graph.last(JointState, "/joint_states").position + turn
    count = int(driver(graph, lambda s: True)["accepted"])
    driver(graph, lambda s: int(s["accepted"]) > count,
           lambda: send(0.5, ROBOT.half_sitting + turn))
    # The legs stand where the stabilizer has them.
    graph.listen(JointState, "/joint_states",
                 lambda got: np.abs(got[-1].position - wanted).max() < STILL)


def test_a_fall_is_reported_and_ends_in_a_reset(graph: Any, send: Callable[..., None]) -> None:
    """A shove of 120 N s fells a walker; it is told why, nothing moves it, and it stands again.

    A shove of 10,000 N s is refused.
    """
    graph.client(PushRobot, "/sim/push_robot")
    with walker(graph) as walk:
        sent = walk.begin(to(2.0), 2)
        refused = graph.call(PushRobot, "/sim/push_robot", impulse=Vector3(x=1e4))
        assert not refused.success
        assert "impulse" in refused.message
        answer = graph.call(PushRobot, "/sim/push_robot", impulse=Vector3(x=20.0, y=-120.0))
        assert answer.success, answer.message
        assert sent.end.result.error_code == Result.FELL, sent.end.result.message
        told = driver(graph, lambda s: "fallen" in s["last_refusal"],
                      lambda: send(2.0, ROBOT.half_sitting))
        assert told["message"].startswith("fell")
        assert float(told["max_tilt_deg"]) > 10.0
        assert walk.send(to(0.5)).end.result.error_code == Result.NOT_READY
        graph.reset()
        driver(graph, lambda s: s["message"] == "holding")
        walk.arrive(to(0.3, dry_run=True))
    zmp = graph.listen(PointStamped, "/zmp", lambda got: len(got) > 100)[-1].point
    assert (zmp.x, zmp.y) == pytest.approx((0.0, 0.0), abs=0.01)


def test_a_reset_while_the_door_is_open_leaves_the_zero_of_its_encoder(graph: Any) -> None:
    assert graph.call(PushDoor, "/sim/push_door", impulse=9.0, duration=0.2).success
    graph.listen(JointState, "/door_angle", lambda got: got[-1].position[0] > 0.1)
    graph.reset()
    graph.listen(JointState, "/door_angle", lambda got: len(got) > 100 and max(
        abs(m.position[0]) for m in got[-100:]) < 0.01)


def test_a_second_driver_is_refused_and_the_first_goes_on(
        graph: Any, start: Callable[..., Any]) -> None:
    """Two drivers of one robot would fight."""
    second = start("run", "hrp2_sim_bridge", "hrp2_sim_bridge", "--ros-args", "--params-file",
                   parameters())
    assert second.wait() == 1
    assert "/hrp2_sim_bridge" in second.text()
    assert "Traceback" not in second.text()
    graph.listen(JointState, "/joint_states", lambda got: len(got) > 100)

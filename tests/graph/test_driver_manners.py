"""The manners of the robot's driver over its topics: what it refuses, a fall, a reset."""

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from door_impact_msgs.srv import PushDoor
from hrp2_description.robot import load_robot_config
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

# A joint that moves less stands still [rad]: sensor noise makes the stabilizer move an ankle by
# up to 4.8 mrad.
STILL = 6e-3
ROBOT = load_robot_config()
HEAD = ROBOT.index("HEAD_JOINT0")


@pytest.fixture(scope="module")
def send(graph: Any) -> Callable[..., None]:
    """Publishes a trajectory to one posture after a time [s]; its stamp is 0 for now [s]."""
    publisher = graph.node.create_publisher(JointTrajectory, "/joint_trajectory", 10)
    graph.spin_until(publisher.get_subscription_count, "the driver")
    time.sleep(1.0)  # a new publisher may be unknown to the driver

    def publish(at: float, position: Any, stamp: int = 0) -> None:
        point = JointTrajectoryPoint(positions=list(position))
        point.time_from_start.sec, point.time_from_start.nanosec = int(at), round(at % 1.0 * 1e9)
        message = JointTrajectory(joint_names=list(ROBOT.joint_names), points=[point])
        message.header.stamp.sec = stamp
        publisher.publish(message)

    return publish


def driver(graph: Any, told: Callable[[dict[str, str]], bool],
           meanwhile: Callable[[], Any] = lambda: None) -> dict[str, str]:
    """The driver's diagnostics once they tell something."""
    def states(heard: list[Any]) -> list[dict[str, str]]:
        return [{**{v.key: v.value for v in s.values}, "message": s.message}
                for m in heard for s in m.status if any(v.key == "refused" for v in s.values)]

    heard = graph.listen(DiagnosticArray, "/diagnostics",
                         lambda got: any(told(s) for s in states(got)), meanwhile=meanwhile)
    return [s for s in states(heard) if told(s)][-1]


@pytest.mark.parametrize(("at", "turn", "ahead", "words"), [
    (1.0, math.nan, False, "HEAD_JOINT0: position"), (0.0, 0.2, False, "HEAD_JOINT0: jump"),
    (1.0, 0.0, True, "use_sim_time")], ids=["NaN", "jump", "another clock"])
def test_bad_trajectories_move_nothing_and_are_reported(
        graph: Any, send: Callable[..., None], at: float, turn: float, ahead: bool,
        words: str) -> None:
    """/diagnostics counts them and names the joint, or the sender's clock, decades ahead."""
    state = graph.last(JointState, "/joint_states")
    rest = dict(zip(state.name, state.position, strict=True))
    goal = np.array([rest[name] for name in ROBOT.joint_names])
    goal[HEAD] += turn
    count = int(driver(graph, lambda s: True)["refused"])
    told = driver(graph, lambda s: int(s["refused"]) > count and words in s.get("last_refusal", ""),
                  lambda: send(at, goal, int(time.time()) if ahead else 0))
    assert "refused" in told["message"]
    heard = graph.listen(JointState, "/joint_states", lambda got: len(got) > 250)
    assert max(np.abs(np.array(m.position) - state.position).max() for m in heard) < STILL


def test_a_good_trajectory_moves_the_joint_it_names(
        graph: Any, send: Callable[..., None]) -> None:
    """The counterpart of the refusals: the head turns by 0.1 rad."""
    state = graph.last(JointState, "/joint_states")
    goal = np.array(ROBOT.half_sitting)
    goal[HEAD] += 0.1
    heard = graph.listen(JointState, "/joint_states", lambda got: len(got) > 400,
                         meanwhile=lambda: send(0.5, goal))
    # The legs stand where the stabilizer has them.
    wanted = np.array(state.position) + (goal - ROBOT.half_sitting)
    assert np.array(heard[-1].position) == pytest.approx(wanted, abs=STILL)


def test_a_fall_is_reported_and_ends_in_a_reset(graph: Any, send: Callable[..., None]) -> None:
    """The robot leans over its toes: it is told why it fell, refuses to move, and stands again."""
    lean = ROBOT.posture({"RLEG_JOINT4": -1.0, "LLEG_JOINT4": -1.0})
    told = driver(graph, lambda s: s["message"].startswith("fell"), lambda: send(0.6, lean))
    assert float(told["max_tilt_deg"]) > 10.0
    told = driver(graph, lambda s: "fallen" in s.get("last_refusal", ""),
                  lambda: send(2.0, ROBOT.half_sitting))
    assert told["message"].startswith("fell")
    assert graph.call(Trigger, "/sim/reset").success
    driver(graph, lambda s: s["message"] == "holding")


def test_pushes_at_once_and_a_reset_leave_the_zero_of_the_door_where_it_is(graph: Any) -> None:
    """Pushes that no hand can make together are refused; after a reset the shut door is at 0."""
    client = graph.node.create_client(PushDoor, "/sim/push_door")
    graph.spin_until(client.service_is_ready, "/sim/push_door")
    push = PushDoor.Request(impulse=200.0, duration=0.2)
    futures: list[Any] = []
    graph.listen(
        JointState, "/door_angle", lambda got: len(got) > 50,
        meanwhile=lambda: futures.extend(client.call_async(push) for _ in range(8)))
    answers = [graph.result(future) for future in futures]
    graph.node.destroy_client(client)
    assert graph.call(Trigger, "/sim/reset").success
    heard = graph.listen(JointState, "/door_angle", lambda got: len(got) > 300)
    assert abs(heard[-1].position[0]) < 0.01
    assert answers[0].success, answers[0].message
    refused = [answer.message for answer in answers if not answer.success]
    assert refused
    assert all("rad/s" in text for text in refused)

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


def send(graph: Any, names: list[str], points: list[tuple[float, list[float]]],
         stamp: int = 0) -> None:
    """Publishes a trajectory that starts at a stamp [s], 0 for now."""
    if not hasattr(graph, "trajectories"):  # one for all: a new one may be unknown to the driver
        graph.trajectories = graph.node.create_publisher(
            JointTrajectory, "/joint_trajectory", 10)
        graph.spin_until(graph.trajectories.get_subscription_count, "the driver")
        time.sleep(1.0)
    message = JointTrajectory(joint_names=names)
    message.header.stamp.sec = stamp
    for at, position in points:
        point = JointTrajectoryPoint(positions=position)
        point.time_from_start.sec = int(at)
        point.time_from_start.nanosec = round((at % 1.0) * 1e9)
        message.points.append(point)
    graph.trajectories.publish(message)


def driver(graph: Any, told: Callable[[dict[str, str]], bool],
           meanwhile: Callable[[], Any] = lambda: None) -> dict[str, str]:
    """The driver's diagnostics once they tell something."""
    def states(heard: list[Any]) -> list[dict[str, str]]:
        return [{**{v.key: v.value for v in s.values}, "message": s.message}
                for m in heard for s in m.status if any(v.key == "refused" for v in s.values)]

    heard = graph.listen(DiagnosticArray, "/diagnostics",
                         lambda got: any(told(s) for s in states(got)), meanwhile=meanwhile)
    return [s for s in states(heard) if told(s)][-1]


@pytest.mark.parametrize(
    ("fault", "words"),
    [("NaN", "HEAD_JOINT0: position in point"), ("jump", "HEAD_JOINT0: jump")])
def test_bad_trajectories_move_nothing_and_are_reported(
        graph: Any, fault: str, words: str) -> None:
    """The joints stay where they are, and /diagnostics counts the refusal and names the joint."""
    state = graph.last(JointState, "/joint_states")
    names, rest = list(state.name), list(state.position)
    head, goal, at = names.index("HEAD_JOINT0"), list(rest), 1.0
    goal[head] += 0.2
    if fault == "NaN":
        goal[head] = math.nan
    else:
        at = 0.0
    count = int(driver(graph, lambda s: True)["refused"])
    told = driver(graph, lambda s: int(s["refused"]) > count and words in s.get("last_refusal", ""),
                  lambda: send(graph, names, [(at, goal)]))
    assert "refused" in told["message"]
    heard = graph.listen(JointState, "/joint_states", lambda got: len(got) > 250)
    assert max(np.abs(np.array(m.position) - rest).max() for m in heard) < STILL


def test_a_good_trajectory_moves_the_joint_it_names(graph: Any) -> None:
    """The counterpart of the refusals: the head turns by 0.1 rad, and back."""
    state, robot = graph.last(JointState, "/joint_states"), load_robot_config()
    names, rest = list(robot.joint_names), robot.half_sitting
    moved = np.array([0.1 if name == "HEAD_JOINT0" else 0.0 for name in names])
    for goal in (rest + moved, rest):
        heard = graph.listen(
            JointState, "/joint_states", lambda got: len(got) > 800,
            meanwhile=lambda goal=goal: send(graph, names, [(0.5, goal.tolist())]))
        assert list(heard[-1].name) == names
        # The legs stand where the stabilizer has them.
        wanted = np.array(state.position) + (goal - rest)
        assert np.array(heard[-1].position) == pytest.approx(wanted, abs=STILL)


def test_a_stamp_of_another_clock_is_refused_with_a_hint(graph: Any) -> None:
    """A sender without use_sim_time stamps by the wall clock: decades ahead."""
    state = graph.last(JointState, "/joint_states")
    told = driver(graph, lambda s: "use_sim_time" in s.get("last_refusal", ""),
                  lambda: send(graph, list(state.name), [(1.0, list(state.position))],
                               stamp=int(time.time())))
    assert "refused" in told["message"]


def test_a_fall_is_reported_and_ends_in_a_reset(graph: Any) -> None:
    """The robot leans over its toes: it is told why it fell, refuses to move, and stands again."""
    robot = load_robot_config()
    lean = robot.posture({"RLEG_JOINT4": -1.0, "LLEG_JOINT4": -1.0}).tolist()
    names = list(robot.joint_names)
    told = driver(graph, lambda s: s["message"].startswith("fell"),
                  lambda: send(graph, names, [(0.6, lean)]))
    assert float(told["max_tilt_deg"]) > 10.0
    told = driver(graph, lambda s: "fallen" in s.get("last_refusal", ""),
                  lambda: send(graph, names, [(2.0, robot.half_sitting.tolist())]))
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
    assert all("rad/s" in text for text in refused)
    assert refused

"""The running graph at work, by the `ros2` command and by a node of the user's own."""

import math
import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from geometry_msgs.msg import PointStamped
from rclpy.action import ActionClient
from rosgraph_msgs.msg import Clock
from running_graph import seconds
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

PLAN = ("service", "call", "/plan_door_impact", "door_impact_msgs/srv/PlanDoorImpact")
ABORTED = 6  # action_msgs/GoalStatus
SUCCEEDED = 4
STILL = 6e-3  # [rad]: noise of the sensors makes the stabilizer move an ankle by up to 4.8 mrad
DURATION = 0.15  # [s] of a push
Codes = PlanDoorImpact.Response


def positions(graph: Any) -> np.ndarray:
    return np.array(graph.last(JointState, "/joint_states").position)


def execute(graph: Any, **goal: Any) -> Any:
    """The result of a goal."""
    client = ActionClient(graph.node, ExecuteDoorImpact, "/execute_door_impact")
    try:
        graph.spin_until(client.server_is_ready, "the action")
        handle = graph.result(client.send_goal_async(ExecuteDoorImpact.Goal(**goal)), "the goal")
        assert handle.accepted
        return graph.result(handle.get_result_async(), "the result")
    finally:
        client.destroy()


def swing(graph: Any, push: Callable[[], Any]) -> float:
    """Largest angle [rad] that a push takes the door to; ends when it has fallen shut."""
    def shut(heard: list[Any]) -> bool:
        angles = [m.position[0] for m in heard]
        return max(angles) > 0.02 and len(angles) > 40 and max(np.abs(angles[-40:])) < 0.003

    heard = graph.listen(JointState, "/door_angle", shut, meanwhile=push)
    assert {tuple(m.name) for m in heard} == {("door_hinge",)}
    return max(m.position[0] for m in heard)


@pytest.fixture(scope="module")
def before(graph: Any, ros2: Callable[..., Any]) -> tuple[Any, Any]:
    """What planner and executor say while nothing is known of the door."""
    asked = ros2(*PLAN, "{desired_opening_angle: 0.35}")
    return asked, execute(graph)


@pytest.fixture(scope="module")
def peaks(graph: Any, before: Any) -> dict[float, float]:
    """Pushes by hand: impulse [N m s] and the largest angle [rad]."""
    def push(impulse: float) -> float:
        answer: list[Any] = []
        peak = swing(graph, lambda: answer.append(graph.call(
            PushDoor, "/sim/push_door", impulse=impulse, duration=DURATION)))
        assert answer[0].success, answer[0].message
        return peak

    return {impulse: push(impulse) for impulse in (7.0, 8.0, 9.0, 9.5)}


@pytest.fixture(scope="module")
def identified(peaks: dict[float, float], ros2: Callable[..., Any]) -> Any:
    """The closer, identified from the pushes by the command line."""
    return ros2("service", "call", "/identify_closer", "door_impact_msgs/srv/IdentifyCloser", "{}")


@pytest.fixture(scope="module")
def plan(graph: Any, identified: Any) -> ImpactPlan:
    """A plan for 0.35 rad, as it stands on the latched topic."""
    answer = graph.call(PlanDoorImpact, "/plan_door_impact", desired_opening_angle=0.35)
    assert answer.success, answer.message
    return graph.listen(ImpactPlan, "/door_impact_plan",
                        lambda heard: heard[-1].plan_id == answer.plan.plan_id, latched=True)[-1]


# -- the door ------------------------------------------------------------------------------------


def test_pushes_move_the_door_as_eq_1_has_it(
        peaks: dict[float, float], reference_door: Callable[..., Any]) -> None:
    """Half sines of torque on the paper door, integrated by other code: peaks within 3 %."""
    for impulse, peak in peaks.items():
        def torque(t: float, impulse: float = impulse) -> float:
            high = impulse * math.pi / (2.0 * DURATION)
            return high * math.sin(math.pi * t / DURATION) if t < DURATION else 0.0

        expected, _ = reference_door().peak(0.0, push=torque)
        assert peak == pytest.approx(expected, rel=0.03)


def test_the_closer_is_identified_from_pushes(identified: Any, paper_door: dict[str, Any]) -> None:
    """Within 5 % of the door's file."""
    assert "success=True" in identified.out, identified.out
    for name, true in {"i_a": paper_door["i_a"], **paper_door["closer"]}.items():
        found = float(re.findall(rf"\b{name}=([-\d.e]+)", identified.out)[0])
        assert found == pytest.approx(true, rel=0.05)


@pytest.mark.usefixtures("identified")
def test_bad_recordings_are_refused(graph: Any) -> None:
    answer = graph.call(IdentifyCloser, "/identify_closer", csv_path="/nowhere/at_all.csv")
    assert (answer.success, answer.error_code) == (False, IdentifyCloser.Response.BAD_RECORDING)
    assert "/nowhere/at_all.csv" in answer.message


# -- planning ------------------------------------------------------------------------------------


def test_without_a_door_there_is_no_plan(before: tuple[Any, Any]) -> None:
    """The service answers NO_DOOR and how to get one; the action is aborted with a message."""
    asked, goal = before
    assert "success=False, error_code=2, message=" in asked.out
    assert "/identify_closer" in asked.out
    assert goal.status == ABORTED
    assert (goal.result.success, goal.result.error_code) == (False, 2)
    assert "/plan_door_impact" in goal.result.message


@pytest.mark.usefixtures("plan")
def test_service_call_prints_the_answer_as_ros_2_does(ros2: Callable[..., Any]) -> None:
    done = ros2(*PLAN, "{desired_opening_angle: 0.35}")
    assert done.status == 0, done.err
    request, _, response = done.out.partition("\nresponse:\n")
    asked = "door_impact_msgs.srv.PlanDoorImpact_Request(desired_opening_angle=0.35, "
    assert f"requester: making request: {asked}" in request
    assert response.startswith("door_impact_msgs.srv.PlanDoorImpact_Response(success=True, "
                               "error_code=0, ")
    assert "phases=[]" in response


def test_the_plan_reaches_the_angle(plan: ImpactPlan, reference_door: Callable[..., Any]) -> None:
    """Eq. (1) by other code takes w' to 0.35 rad; eqs. (2) and (3) hold; the ZMP stays inside."""
    angle, when = reference_door().peak(plan.omega_door)
    assert angle == pytest.approx(0.35, rel=0.03)  # of the true door: identification errs a little
    assert when == pytest.approx(plan.peak_time, rel=0.05)
    momentum = plan.effective_mass * (plan.v_rb - plan.v_rb_post) * plan.l_b
    assert momentum == pytest.approx(12.75 * plan.omega_door, rel=0.05)
    separation = plan.omega_door * plan.l_b - plan.v_rb_post
    assert separation == pytest.approx(plan.apparent_restitution * plan.v_rb, rel=1e-3)
    assert 0.4 < plan.apparent_restitution < 0.5  # 0.5 of the surface, and the robot gives
    assert 1.0 / plan.effective_mass_planar == pytest.approx(
        1.0 / 58.0 + plan.a_r**2 / plan.i_rob, rel=1e-3)
    assert [m.phase for m in plan.zmp_margins] == [p.name for p in plan.phases]
    assert min(m.margin for m in plan.zmp_margins) > 0.0
    assert all(len(p.trajectory.points) >= 2 for p in plan.phases)


@pytest.mark.parametrize(
    ("fields", "codes", "words"),
    [({"desired_opening_angle": math.nan}, {Codes.INVALID_REQUEST}, "nan"),
     ({"desired_opening_angle": 3.0}, {Codes.ANGLE_UNREACHABLE}, "deg"),
     ({"door_distance": 5.0}, {Codes.POSTURE_UNREACHABLE}, "door must stand"),
     ({"run_up": "leap"}, {Codes.INVALID_REQUEST}, "zmp_limited")])
def test_what_cannot_be_planned_is_refused_and_the_last_plan_stays(
        graph: Any, plan: ImpactPlan, fields: dict[str, Any], codes: set[int], words: str) -> None:
    """The right error code, a sentence with the value, and /door_impact_plan as it was."""
    last = graph.last(ImpactPlan, "/door_impact_plan", latched=True)
    answer = graph.call(PlanDoorImpact, "/plan_door_impact",
                        **{"desired_opening_angle": 0.35, **fields})
    assert answer.success is False
    assert answer.error_code in codes, answer.message
    assert words in answer.message
    assert len(answer.message.split()) > 4
    assert answer.plan.plan_id == ""
    after = graph.last(ImpactPlan, "/door_impact_plan", latched=True)
    assert (after.plan_id, after.header.stamp) == (last.plan_id, last.header.stamp)


# -- moving --------------------------------------------------------------------------------------


@pytest.mark.usefixtures("plan")
def test_a_dry_run_succeeds_and_nothing_moves(graph: Any) -> None:
    rest = positions(graph)
    ended = execute(graph, dry_run=True)
    assert (ended.status, ended.result.success) == (SUCCEEDED, True), ended.result.message
    heard = graph.listen(JointState, "/joint_states", lambda got: len(got) > 200)
    assert max(np.abs(np.array(m.position) - rest).max() for m in heard) < STILL


@pytest.mark.usefixtures("plan")
def test_goals_that_make_no_sense_are_aborted(graph: Any) -> None:
    """An unknown plan and a speed_scale of 0 are told by name."""
    for goal, word in (({"plan_id": "nonsense"}, "nonsense"), ({"speed_scale": 0.0}, "speed_scale"),
                       ({"speed_scale": math.nan}, "speed_scale")):
        ended = execute(graph, **goal)
        assert (ended.status, ended.result.success) == (ABORTED, False)
        assert word in ended.result.message


# -- last, because it turns back time ------------------------------------------------------------


def test_reset_brings_time_back_to_0(graph: Any, reference_door: Callable[..., Any]) -> None:
    """The clock starts anew, the robot stands at its first place, and the door can be pushed."""
    def restarted(heard: list[Any]) -> bool:
        return any(b < a for a, b in pairwise(times(heard)))

    def times(heard: list[Any]) -> list[float]:
        return [seconds(m.clock) for m in heard]

    heard = times(graph.listen(Clock, "/clock", restarted,
                               meanwhile=lambda: graph.call(Trigger, "/sim/reset")))
    assert heard[0] > 1.0
    back = next(b for a, b in pairwise(heard) if b < a)
    assert back < 0.1
    zmp = graph.listen(PointStamped, "/zmp", lambda got: len(got) > 100)[-1].point
    assert (zmp.x, zmp.y) == pytest.approx((0.0, 0.0), abs=0.01)
    peak = swing(graph, lambda: graph.call(PushDoor, "/sim/push_door", impulse=8.0,
                                           duration=DURATION))
    assert math.degrees(peak) == pytest.approx(19.26, rel=0.03)


def test_of_two_goals_at_once_one_runs_and_a_stop_ends_it(graph: Any, plan: ImpactPlan) -> None:
    client = ActionClient(graph.node, ExecuteDoorImpact, "/execute_door_impact")
    try:
        graph.spin_until(client.server_is_ready, "the action")
        sent = [client.send_goal_async(ExecuteDoorImpact.Goal(plan_id=plan.plan_id))
                for _ in range(2)]
        handles = [graph.result(future, "an answer to a goal") for future in sent]
        assert [handle.accepted for handle in handles].count(True) == 1
        running = next(handle for handle in handles if handle.accepted)
        assert graph.call(Trigger, "/stop").success
        result = graph.result(running.get_result_async(), "the end of the goal").result
        assert result.error_code == ExecuteDoorImpact.Result.STOPPED
    finally:
        client.destroy()


def test_a_reset_in_a_motion_ends_it(graph: Any, plan: ImpactPlan) -> None:
    """The executor gives up what was planned in time, and takes a goal again."""
    graph.call(Trigger, "/sim/reset")
    client = ActionClient(graph.node, ExecuteDoorImpact, "/execute_door_impact")
    try:
        graph.spin_until(client.server_is_ready, "the action")
        handle = graph.result(
            client.send_goal_async(ExecuteDoorImpact.Goal(plan_id=plan.plan_id)), "the goal")
        rest = positions(graph)
        graph.listen(JointState, "/joint_states",
                     lambda got: np.abs(np.array(got[-1].position) - rest).max() > 0.1)
        graph.call(Trigger, "/sim/reset")
        result = graph.result(handle.get_result_async(), "the end of the goal").result
        assert result.error_code == ExecuteDoorImpact.Result.STOPPED
    finally:
        client.destroy()
    assert execute(graph, dry_run=True, plan_id=plan.plan_id).result.success


def test_a_message_of_other_joints_ends_no_node(graph: Any) -> None:
    stranger = graph.node.create_publisher(JointState, "/joint_states", 10)
    graph.spin_until(lambda: stranger.get_subscription_count() >= 2, "the nodes that listen")
    stranger.publish(JointState(name=["gripper"], position=[1.0]))
    assert graph.call(Trigger, "/stop").success
    graph.node.destroy_publisher(stranger)

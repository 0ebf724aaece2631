"""The running graph at work, by the `ros2` command and by a node of the user's own."""

import math
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from geometry_msgs.msg import PointStamped
from rclpy.action import ActionClient
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger

PLAN = ("service", "call", "/plan_door_impact", "door_impact_msgs/srv/PlanDoorImpact")
ABORTED = 6  # action_msgs/GoalStatus
SUCCEEDED = 4
STILL = 6e-3  # [rad]: noise of the sensors makes the stabilizer move an ankle by up to 4.8 mrad
DURATION = 0.15  # [s] of a push
Codes = PlanDoorImpact.Response


def positions(graph: Any) -> np.ndarray:
    return np.array(graph.last(JointState, "/joint_states").position)


@contextmanager
def executor(graph: Any) -> Iterator[Callable[..., list[Any]]]:
    """Sends goals at once, and returns the futures of the results of those that are accepted."""
    client = ActionClient(graph.node, ExecuteDoorImpact, "/execute_door_impact")

    def send(*goals: dict[str, Any]) -> list[Any]:
        sent = [client.send_goal_async(ExecuteDoorImpact.Goal(**goal)) for goal in goals]
        handles = [graph.result(future, "an answer to a goal") for future in sent]
        return [handle.get_result_async() for handle in handles if handle.accepted]

    try:
        graph.spin_until(client.server_is_ready, "the action")
        yield send
    finally:
        client.destroy()


def execute(graph: Any, **goal: Any) -> Any:
    """The end of a goal."""
    with executor(graph) as send:
        (future,) = send(goal)
        return graph.result(future, "the end of the goal")


def push(graph: Any, impulse: float) -> float:
    """Push the door by hand [N m s]; the largest angle [rad], when it has fallen shut."""
    def shut(heard: list[Any]) -> bool:
        angles = [m.position[0] for m in heard]
        return max(angles) > 0.02 and len(angles) > 40 and max(np.abs(angles[-40:])) < 0.003

    def by_hand() -> None:
        answer = graph.call(PushDoor, "/sim/push_door", impulse=impulse, duration=DURATION)
        assert answer.success, answer.message

    heard = graph.listen(JointState, "/door_angle", shut, meanwhile=by_hand)
    assert {tuple(m.name) for m in heard} == {("door_hinge",)}
    return max(m.position[0] for m in heard)


@pytest.fixture(scope="module")
def before(graph: Any, ros2: Callable[..., Any]) -> tuple[Any, Any]:
    """What planner and executor say while nothing is known of the door."""
    return ros2(*PLAN, "{desired_opening_angle: 0.35}"), execute(graph)


@pytest.fixture(scope="module")
def peaks(graph: Any, before: Any) -> dict[float, float]:
    """Pushes by hand: impulse [N m s] and the largest angle [rad]."""
    return {impulse: push(graph, impulse) for impulse in (7.0, 8.0, 9.0, 9.5)}


@pytest.fixture(scope="module")
def identified(graph: Any, peaks: dict[float, float]) -> Any:
    """The closer, identified from the pushes."""
    answer = graph.call(IdentifyCloser, "/identify_closer")
    assert answer.success, answer.message
    return answer.parameters


@pytest.fixture(scope="module")
def plan(graph: Any, identified: Any, ros2: Callable[..., Any]) -> ImpactPlan:
    """A plan for 0.35 rad, asked for by the command line, as it stands on the latched topic."""
    done = ros2(*PLAN, "{desired_opening_angle: 0.35}")
    assert "_Response(success=True, error_code=0, " in done.out, done.out + done.err
    return graph.last(ImpactPlan, "/door_impact_plan", latched=True)


def test_pushes_move_the_door_as_eq_1_has_it(
        peaks: dict[float, float], reference_door: Callable[..., Any]) -> None:
    """Half sines of torque on the paper door, integrated by other code: peaks within 3 %."""
    for impulse, peak in peaks.items():
        def torque(t: float, high: float = impulse * math.pi / (2.0 * DURATION)) -> float:
            return high * math.sin(math.pi * t / DURATION) if t < DURATION else 0.0

        expected, _ = reference_door().peak(0.0, push=torque)
        assert peak == pytest.approx(expected, rel=0.03)


def test_the_closer_is_identified_from_pushes(identified: Any, paper_door: dict[str, Any]) -> None:
    """Within 5 % of the door's file."""
    for name, true in {"i_a": paper_door["i_a"], **paper_door["closer"]}.items():
        assert getattr(identified, name) == pytest.approx(true, rel=0.05)


def test_without_a_door_there_is_no_plan(before: tuple[Any, Any]) -> None:
    """The service answers NO_DOOR and how to get one; the action is aborted with a message."""
    asked, goal = before
    assert "success=False, error_code=2, message=" in asked.out
    assert "/identify_closer" in asked.out
    assert (goal.status, goal.result.error_code) == (ABORTED, 2)
    assert "/plan_door_impact" in goal.result.message


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


@pytest.mark.parametrize(("fields", "code"), [
    ({"desired_opening_angle": 3.0}, Codes.ANGLE_UNREACHABLE),
    ({"run_up": "leap"}, Codes.INVALID_REQUEST)])
def test_what_cannot_be_planned_is_refused_and_the_last_plan_stays(
        graph: Any, plan: ImpactPlan, fields: dict[str, Any], code: int) -> None:
    answer = graph.call(PlanDoorImpact, "/plan_door_impact",
                        **{"desired_opening_angle": 0.35, **fields})
    assert (answer.success, answer.error_code) == (False, code), answer.message
    assert answer.plan.plan_id == ""
    after = graph.last(ImpactPlan, "/door_impact_plan", latched=True)
    assert (after.plan_id, after.header.stamp) == (plan.plan_id, plan.header.stamp)


def test_a_dry_run_succeeds_and_a_goal_that_makes_no_sense_is_aborted(
        graph: Any, plan: ImpactPlan) -> None:
    """Neither moves anything; an unknown plan is told by name."""
    rest = positions(graph)
    ended = execute(graph, dry_run=True)
    assert (ended.status, ended.result.success) == (SUCCEEDED, True), ended.result.message
    ended = execute(graph, plan_id="nonsense")
    assert ended.status == ABORTED
    assert "nonsense" in ended.result.message
    heard = graph.listen(JointState, "/joint_states", lambda got: len(got) > 200)
    assert max(np.abs(np.array(m.position) - rest).max() for m in heard) < STILL


def test_after_a_reset_the_robot_stands_at_its_first_place_and_the_door_swings_as_before(
        graph: Any, peaks: dict[float, float]) -> None:
    graph.reset()
    zmp = graph.listen(PointStamped, "/zmp", lambda got: len(got) > 100)[-1].point
    assert (zmp.x, zmp.y) == pytest.approx((0.0, 0.0), abs=0.01)
    assert push(graph, 8.0) == pytest.approx(peaks[8.0], rel=0.03)


@contextmanager
def frozen(graph: Any) -> Iterator[None]:
    """The simulation, its clock included, stands still meanwhile."""
    bridges = [pid for pid in graph.processes[0].family()
               if b"hrp2_sim_bridge" in Path(f"/proc/{pid}/cmdline").read_bytes()]
    for pid in bridges:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in bridges:
            os.kill(pid, signal.SIGCONT)


@pytest.mark.parametrize("how", ["/stop", "/sim/reset", "a simulation that hangs"])
def test_what_ends_the_only_motion(graph: Any, plan: ImpactPlan, how: str) -> None:
    """Of two goals at once one runs; after its end the executor takes a goal again."""
    graph.reset()
    with executor(graph) as send:
        (future,) = send({"plan_id": plan.plan_id}, {"plan_id": plan.plan_id})
        rest = positions(graph)
        graph.listen(JointState, "/joint_states", lambda got: future.done() or np.abs(
            np.array(got[-1].position) - rest).max() > 0.1)
        if how.startswith("/"):
            assert graph.call(Trigger, how).success
            ended = graph.result(future).result
        else:  # its silence is measured by the computer's steady clock
            with frozen(graph):
                ended = graph.result(future).result
            assert "no message has arrived on " in ended.message
        assert ended.error_code == ExecuteDoorImpact.Result.STOPPED, ended.message
    graph.reset()
    assert execute(graph, dry_run=True, plan_id=plan.plan_id).result.success


def test_a_foreign_publisher_is_named_and_what_it_says_is_dropped(
        graph: Any, plan: ImpactPlan) -> None:
    """An IMU upside down does not end a motion, nor do joints of another robot a node."""
    graph.reset()
    strangers = [graph.node.create_publisher(kind, topic, 10)
                 for kind, topic in ((JointState, "/joint_states"), (Imu, "/imu"))]
    odd, told = graph.last(Imu, "/imu"), dict[str, str]()
    odd.orientation.x, odd.orientation.w = 1.0, 0.0
    odd.header.stamp.sec += 1000

    def noticed(heard: list[Any]) -> bool:
        strangers[0].publish(JointState(name=["gripper"], position=[1.0]))
        strangers[1].publish(odd)
        told.update((v.key, v.value) for s in heard[-1].status for v in s.values)
        return told.get("publishers of imu") == "/hrp2_sim_bridge, /tests_of_the_graph" and any(
            "dropped on imu" in key for key in told)

    with executor(graph) as send:
        (future,) = send({"plan_id": plan.plan_id})
        graph.listen(DiagnosticArray, "/diagnostics", noticed)
        assert graph.call(Trigger, "/stop").success
        assert graph.result(future).result.error_code == ExecuteDoorImpact.Result.STOPPED
    for each in strangers:
        graph.node.destroy_publisher(each)

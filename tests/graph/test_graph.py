"""The running graph at work, by the `ros2` command and by a node of the user's own."""

import math
import os
import re
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from action_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from door_impact_evaluation.demo import results
from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_msgs.action import ExecuteDoorImpact, Walk, WalkThroughDoor
from door_impact_msgs.msg import ImpactPlan
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from processes import GUARD, find_ros2
from rclpy.action import ActionClient
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger

NODES = ["/closer_identifier", "/door_encoder", "/hrp2_sim_bridge", "/impact_planner",
         "/motion_server", "/scene_publisher", "/zmp_publisher"]
PLAN = ("service", "call", "/plan_door_impact", "door_impact_msgs/srv/PlanDoorImpact")
ABORTED = 6  # action_msgs/GoalStatus
SUCCEEDED = 4
STILL = 6e-3  # [rad]: noise of the sensors makes the stabilizer move an ankle by up to 4.8 mrad
DURATION = 0.15  # [s] of a push
Codes = PlanDoorImpact.Response
README = Path(__file__).resolve().parents[2] / "README.md"


def positions(graph: Any) -> np.ndarray:
    return np.array(graph.last(JointState, "/joint_states").position)


@contextmanager
def executor(graph: Any, kind: Any = ExecuteDoorImpact, name: str = "/execute_door_impact",
             ) -> Iterator[Callable[..., list[Any]]]:
    """Sends goals at once, and returns the futures of their results."""
    client = ActionClient(graph.node, kind, name)

    def send(*goals: dict[str, Any]) -> list[Any]:
        sent = [client.send_goal_async(kind.Goal(**goal)) for goal in goals]
        handles = [graph.result(future, "an answer to a goal") for future in sent]
        return [handle.get_result_async() for handle in handles]

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


@pytest.mark.usefixtures("graph")
def test_node_list_shows_every_node(ros2: Callable[..., Any]) -> None:
    """Once they are discovered."""
    end, shown = time.monotonic() + GUARD, list[str]()
    while [name for name in shown if name != "/tests_of_the_graph"] != NODES:
        assert time.monotonic() < end, shown
        shown = ros2("node", "list").out.split()


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


def test_without_a_door_there_is_no_plan(before: tuple[Any, Any]) -> None:
    """The service answers NO_DOOR and how to get one; the action is aborted with a message."""
    asked, goal = before
    assert "success=False, error_code=2, message=" in asked.out
    assert "/identify_closer" in asked.out
    assert (goal.status, goal.result.error_code) == (ABORTED, 2)
    assert "plan_door_impact" in goal.result.message


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


@pytest.mark.parametrize("how", ["/sim/reset", "a simulation that hangs"])
def test_what_ends_the_only_motion(graph: Any, plan: ImpactPlan, how: str) -> None:
    """Of two goals at once one runs, which the other is told; after its end one may run again."""
    graph.reset()
    with executor(graph) as send:
        future, second = send({"plan_id": plan.plan_id}, {"plan_id": plan.plan_id})
        assert "a hit is being executed" in graph.result(second).result.message
        rest = positions(graph)
        graph.listen(JointState, "/joint_states", lambda got: future.done() or np.abs(
            np.array(got[-1].position) - rest).max() > 0.1)
        if how == "/sim/reset":
            assert graph.call(Trigger, how).success
            ended = graph.result(future).result
        else:  # its silence is measured by the computer's steady clock
            with graph.frozen("hrp2_sim_bridge"):
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


@dataclass(frozen=True)
class Passage:
    """What the action says of a passage, and what the simulation's log shows."""

    result: Any
    log: simulation_log.SimulationLog
    touching: set[str]  # bodies of the robot that were on the leaf
    hit: evaluation.Impact
    truth: dict[str, Any]  # "passage" of summary.json


@pytest.fixture(scope="module")
def printed() -> tuple[str, str]:
    """The commands of the README's section Use, and the last one of them."""
    use = README.read_text(encoding="utf-8").split("## Use\n")[1].split("```sh\n")[1]
    commands = use.split("```")[0].replace(". .venv/bin/activate\n", "").strip()
    before, _, last = commands.rpartition("\n")
    assert "/walk_through_door" in before
    assert " /walk " in last
    return before, last


def typed(commands: str, runs: int) -> None:
    """Type commands into a shell; as many as `runs` are answered, each with success."""
    path = f"{Path(find_ros2()).parent}:{os.environ['PATH']}"
    done = subprocess.run(["bash", "-ec", commands], env={**os.environ, "PATH": path}, text=True,
                          capture_output=True, timeout=GUARD, check=False)
    answers = re.findall(r"success[=:] ?(\w+)", done.stdout)
    assert (done.returncode, [answer.lower() for answer in answers]) == (0, ["true"] * runs), (
        f"{answers} {done.stdout[-5000:]}{done.stderr}")


def last_result(graph: Any, kind: Any, name: str) -> Any:
    """The result of the last goal of an action, whoever has sent it."""
    goals = graph.last(GoalStatusArray, f"{name}/_action/status", latched=True).status_list
    return graph.call(kind.Impl.GetResultService, f"{name}/_action/get_result",
                      goal_id=goals[-1].goal_info.goal_id).result


@pytest.fixture(scope="module")
def passed(graph: Any, identified: Any, printed: tuple[str, str]) -> Passage:
    """The robot does what the README prints: hits, walks, hits again, and walks through."""
    graph.reset()
    typed(printed[0].replace('WalkThroughDoor "{}"',
                             'WalkThroughDoor "{include_trajectories: true}"'), 10)
    result = last_result(graph, WalkThroughDoor, "/walk_through_door")
    assert result.success, result.message
    graph.listen(JointState, "/joint_states", lambda got: len(got) > 600)  # it must stand on
    saved = graph.call(Trigger, "/hrp2_sim_bridge/save_log")
    assert saved.success, saved.message
    log = simulation_log.load(Path(saved.message), 0.0)
    hit = evaluation.impact(log.motion, 1.0, since=result.contact_time - 0.5)
    contact, peak = (float(log.motion.t[at]) for at in (hit.contact.start, hit.peak))
    support = evaluation.support(log.motion, log.robot, window=evaluation.WINDOW)
    truth = results.passage_figures(result, "paper", log, SimpleNamespace(
        phases={"hit": (contact, peak)}, support=support, contact_time=contact, peak_time=peak))
    with np.load(saved.message) as raw:
        links = np.unique(raw["contact_link"][raw["contact_force"] > 5.0])
        touching = {str(raw["link_names"][link]) for link in links}
    return Passage(result, log, touching, hit, truth)


def test_the_robot_walks_through_the_door(passed: Passage) -> None:
    """By the simulation's truth: it stands beyond the wall, and only its right arm met the leaf."""
    motion, truth = passed.log.motion, passed.truth
    assert truth["passed"], truth
    assert motion.base_position[-1, 1] < -passed.log.door_distance
    assert passed.hit.contacts_before_peak == 1
    assert all(name.startswith(("RARM", "r_")) for name in passed.touching)
    assert truth["min_clearance_mm"] > 25.0
    assert truth["min_margin_mm"] > 10.0
    assert motion.door_angle[-1] < np.radians(1.0)


def test_beyond_the_door_it_walks_on(graph: Any, passed: Passage, printed: tuple[str, str]) -> None:
    """With the README's last command; back through the shut door it does not."""
    typed(printed[1], 1)
    with executor(graph, Walk, "/walk") as send:
        (future,) = send({})
        refused = graph.result(future, "an answer").result
    assert refused.error_code == Walk.Result.INFEASIBLE
    assert "in the way after" in refused.message
    gone = last_result(graph, Walk, "/walk").pose.pose.position
    assert gone.y < passed.log.motion.base_position[-1, 1] - 1.0


def test_what_is_said_of_the_passage_is_what_happened(passed: Passage) -> None:
    """Steps, angles, times and forces of the action's answer, by the simulation's log."""
    said, truth, motion = passed.result, passed.truth, passed.log.motion
    release = said.start_time + said.plan.release_time
    walking, soles = motion.t > said.start_time, np.stack([motion.left_sole, motion.right_sole])
    lifted = soles[:, walking, 2] > 0.01
    assert said.steps == len(said.plan.footsteps) == np.sum(lifted[:, 1:] & ~lifted[:, :-1])
    assert said.contact_time == pytest.approx(motion.t[passed.hit.contact.start], abs=0.02)
    assert said.peak_angle == pytest.approx(motion.door_angle[passed.hit.peak], abs=0.005)
    assert said.release_angle == pytest.approx(
        np.interp(release, motion.t, motion.door_angle), abs=0.01)
    assert said.hit_to_clear == pytest.approx(truth["hit_to_clear_s"], abs=0.5)
    assert math.degrees(said.largest_leaf_error) == pytest.approx(
        truth["leaf_angle_error_deg"], abs=0.3)
    held = walking & (motion.t < release)
    pressed = evaluation.centred_mean(motion.contact_force[:, None], 20)[held].max()
    assert said.largest_hand_force == pytest.approx(pressed, rel=0.2)

"""The node impact_planner, whose topics and services are used over the middleware."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rclpy
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import CloserParameters, HitReport, ImpactPlan
from door_impact_msgs.srv import PlanDoorImpact
from impact_planner.ros.impact_planner_node import ImpactPlanner, main
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from std_srvs.srv import Trigger
from unique_identifier_msgs.msg import UUID

Answer = PlanDoorImpact.Response
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Rig:
    """The planner and a node that plays the identifier, the executor and the user."""

    def __init__(self) -> None:
        self.node = ImpactPlanner()
        self.other = rclpy.create_node("other")
        self.closer = self.other.create_publisher(CloserParameters, "/closer_parameters", LATCHED)
        self.client = self.other.create_client(PlanDoorImpact, "/plan_door_impact")
        self.reports = self.other.create_publisher(HitReport, "/hit_report", 10)
        self.forgetting = self.other.create_client(Trigger, "/forget_hits")
        self.goals = ActionClient(self.other, ExecuteDoorImpact, "/execute_door_impact")
        self.server = ActionServer(
            self.other, ExecuteDoorImpact, "/execute_door_impact", self._execute)
        self.may_end, self.end = Future(), ""
        self.plans: list[ImpactPlan] = []
        self.other.create_subscription(ImpactPlan, "/door_impact_plan", self.plans.append, LATCHED)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.executor.add_node(self.other)

    def until(self, done: Callable[[], bool]) -> None:
        """Spin until a condition holds; a limit ends a test that would wait for ever."""
        limit = time.monotonic() + 120.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            self.executor.spin_once(timeout_sec=0.05)

    def ask(self, **fields: Any) -> Any:
        """Call /plan_door_impact."""
        future = self.client.call_async(PlanDoorImpact.Request(**fields))
        self.until(future.done)
        return future.result()

    def forget(self) -> Any:
        """Call /forget_hits."""
        future = self.forgetting.call_async(Trigger.Request())
        self.until(future.done)
        return future.result()

    async def _execute(self, goal: Any) -> Any:
        """Execute a goal until it may end, and end it in the state that the test wants."""
        await self.may_end
        getattr(goal, self.end)()
        return ExecuteDoorImpact.Result()

    def report(self, plan: Any, share: float = 1.0, **fields: Any) -> None:
        """Publish a report of a hit that opened the door to a share of the desired angle."""
        self.reports.publish(HitReport(**{
            "plan_id": plan.plan_id, "door": plan.door, "contact_delay": 0.004,
            "peak_angle": share * plan.desired_opening_angle,
            "switch_latency": plan.switch_time - plan.contact_time, "v_rb_post": math.nan,
            **fields}))

    def run(self, end: str = "succeed") -> UUID:
        """Execute a goal without a report, and return its identifier after its end."""
        self.may_end, self.end = Future(), end
        sent = self.goals.send_goal_async(ExecuteDoorImpact.Goal())
        self.until(sent.done)
        goal, seen = sent.result(), self.node._learner._reports._goals
        self.until(lambda: bytes(goal.goal_id.uuid) in seen)
        if end == "canceled":
            self.until(goal.cancel_goal_async().done)
        self.may_end.set_result(None)
        self.until(goal.get_result_async().done)
        self.until(lambda: seen[bytes(goal.goal_id.uuid)].end is not None)
        return goal.goal_id

    def hit(self, plan: Any, share: float = 1.0, end: str = "succeed", **fields: Any) -> None:
        """Execute a goal, and report its hit."""
        self.report(plan, share, goal_id=self.run(end), **fields)

    def learned(self, hits: int, door: str = "paper") -> None:
        """Wait until the planner has learned from a number of hits on a door."""
        def experience() -> Any:
            return self.node._learner.experience(door)

        self.until(lambda: experience() is not None and experience().hits == hits)


@contextmanager
def running(*parameters: str) -> Iterator[Rig]:
    """A rig on its own domain, whose planner has parameters NAME:=VALUE."""
    flags = [word for each in parameters for word in ("-p", each)]
    rclpy.init(args=["--ros-args", *flags] if flags else None)
    made = Rig()
    try:
        made.until(lambda: made.client.service_is_ready() and made.forgetting.service_is_ready()
                   and made.goals.server_is_ready() and made.reports.get_subscription_count() > 0)
        yield made
    finally:
        made.executor.shutdown()
        made.server.destroy()
        made.goals.destroy()
        made.node.destroy_node()
        made.other.destroy_node()
        rclpy.shutdown()


@pytest.fixture
def rig() -> Iterator[Rig]:
    """A rig whose planner has its default parameters."""
    with running() as made:
        yield made


def closer(known: Any) -> CloserParameters:
    """The message of an identifier for the paper's door."""
    door = known.door
    return CloserParameters(
        door="identified", i_a=door.i_a, c_c=door.c_c, k_c=door.k_c,
        tau_c0_prime=door.tau_c0_prime, link_l=door.closer.l, link_l1=door.closer.l1,
        link_l2=door.closer.l2, link_l3=door.closer.l3, theta_i0=door.closer.theta_i0,
        leaf_width=known.width,
    )  # fmt: skip


def test_without_a_door_there_is_no_plan_and_with_one_there_is(rig: Rig, known: Any) -> None:
    """NO_DOOR comes first; after /closer_parameters the topic has the plan with trajectories."""
    answer = rig.ask(desired_opening_angle=0.4)
    assert not answer.success
    assert answer.error_code == Answer.NO_DOOR
    assert "/identify_closer" in answer.message
    rig.closer.publish(closer(known))
    rig.until(lambda: rig.node._identified is not None)
    answer = rig.ask(desired_opening_angle=math.radians(25.0))
    assert answer.success, answer.message
    assert answer.plan.omega_door == pytest.approx(0.635, abs=1e-3)
    assert answer.plan.door == "identified"
    assert len(answer.plan.phases) == 0
    rig.until(lambda: bool(rig.plans))
    assert rig.plans[0].plan_id == answer.plan.plan_id
    assert [phase.name for phase in rig.plans[0].phases][-3:] == ["cam", "post", "hold"]


def test_refusals_are_codes_and_leave_the_last_plan_alone(rig: Rig, known: Any) -> None:
    """Every kind of bad request is answered with its code, and no plan is published for it."""
    rig.closer.publish(closer(known))
    rig.until(lambda: rig.node._identified is not None)
    good = rig.ask(desired_opening_angle=0.4, include_trajectories=True)
    assert len(good.plan.phases) == 7
    rig.until(lambda: len(rig.plans) == 1)
    for fields, code in (
        ({"desired_opening_angle": math.nan}, Answer.INVALID_REQUEST),
        ({"desired_opening_angle": 3.0}, Answer.ANGLE_UNREACHABLE),
        ({"desired_opening_angle": 1.1}, Answer.SPEED_UNREACHABLE),
        ({"desired_opening_angle": 0.4, "door_distance": 2.0}, Answer.POSTURE_UNREACHABLE),
    ):
        answer = rig.ask(**fields)
        assert not answer.success, fields
        assert answer.error_code == code, answer.message
        assert answer.message
    again = rig.ask(desired_opening_angle=0.3)
    rig.until(lambda: len(rig.plans) == 2)
    assert [plan.plan_id for plan in rig.plans] == [good.plan.plan_id, again.plan.plan_id]


def test_parameters_change_the_next_plan_or_are_refused(rig: Rig) -> None:
    """A configured door makes plans possible, and a bad value changes nothing."""
    done = rig.node.set_parameters([Parameter("door", value="paper")])
    assert done[0].successful
    before = rig.ask(desired_opening_angle=0.4).plan
    assert before.restitution == 0.5
    assert rig.node.set_parameters([Parameter("restitution", value=0.7)])[0].successful
    refused = rig.node.set_parameters([Parameter("restitution", value=7.0)])[0]
    assert not refused.successful
    assert "restitution" in refused.reason
    assert not rig.node.set_parameters([Parameter("door", value="no_such_door")])[0].successful
    after = rig.ask(desired_opening_angle=0.4).plan
    assert after.restitution == 0.7
    assert after.v_rb < before.v_rb


def test_a_hit_changes_the_next_plan_and_is_forgotten_on_request(capfd: Any) -> None:
    """Only a plausible hit of the last plan counts; after a peak 10 % too high v_rB is lower."""
    with running("door:=paper") as rig:
        first = rig.ask(desired_opening_angle=0.4).plan
        assert first.learned_hits == 0
        rig.hit(first, plan_id="another", share=1.1)
        rig.hit(first, peak_angle=math.nan)
        rig.hit(first, share=1e-3)
        goal = rig.run()
        rig.report(first, share=1.1, goal_id=goal)
        rig.report(first, share=1.1, goal_id=goal)  # the same report again
        rig.learned(1)
        second = rig.ask(desired_opening_angle=0.4).plan
        assert second.learned_hits == 1
        assert 0.9 * first.v_rb < second.v_rb < 0.97 * first.v_rb
        assert second.omega_door == first.omega_door
        captured = capfd.readouterr()
        log = captured.out + captured.err
        assert log.count("nothing was learned from the hit of plan") == 4
        assert "'another'" in log
        assert "normalised innovation squared" in log
        assert "only the first one counts" in log
        rig.hit(first, share=1.1)  # it is no longer the last plan
        assert "paper" in rig.forget().message
        third = rig.ask(desired_opening_angle=0.4).plan
        assert (third.plan_id, third.learned_hits) == (first.plan_id, 0)


def test_the_experience_of_hits_outlives_the_node(tmp_path: Path) -> None:
    """experience_file keeps it; forgetting empties the file, an implausible hit leaves it alone."""
    path = tmp_path / "deep" / "hits.yaml"
    parameters = ("door:=paper", f"experience_file:={path}", f"allowed_folders:=['{tmp_path}']")
    with running(*parameters) as rig:
        first = rig.ask(desired_opening_angle=0.4).plan
        rig.hit(first, share=1e-3)
        rig.hit(first, share=1.1)
        rig.until(path.exists)
        taught = rig.ask(desired_opening_angle=0.4).plan
        assert taught.learned_hits == 1
    with running(*parameters) as rig:
        again = rig.ask(desired_opening_angle=0.4).plan
        assert (again.plan_id, again.learned_hits) == (taught.plan_id, 1)
        assert rig.forget().success
    with running(*parameters) as rig:
        assert rig.ask(desired_opening_angle=0.4).plan.plan_id == first.plan_id


def test_a_file_of_hits_that_cannot_be_read_ends_the_node_in_one_line_and_is_kept(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The node neither plans without the experience nor overwrites the file."""
    path = tmp_path / "hits.yaml"
    path.write_text("paper: {hits: 1, mass_factor: 1.0, restitution: 2.0, covariance: []}\n")
    before = path.read_bytes()
    allowed = f"allowed_folders:=['{tmp_path}']"
    assert main(["--ros-args", "-p", f"experience_file:={path}", "-p", allowed]) == 1
    errors = [line for line in capfd.readouterr().err.splitlines() if line.strip()]
    assert len(errors) == 1
    assert str(path) in errors[0]
    assert path.read_bytes() == before


def test_a_bad_parameter_ends_the_node_with_a_message(capfd: pytest.CaptureFixture[str]) -> None:
    """The exit code is 1, and one sentence is printed without a traceback."""
    assert main(["--ros-args", "-p", "restitution:=2.0"]) == 1
    found = capfd.readouterr().err
    assert "restitution" in found
    assert "Traceback" not in found

"""The node impact_planner, whose topics and services are used over the middleware."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import rclpy
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import CloserParameters, HitReport, ImpactPlan
from door_impact_msgs.srv import PlanDoorImpact
from door_model.door.config import load_door
from impact_planner.ros.impact_planner_node import ImpactPlanner, main
from impact_planner.task.known_door import KnownDoor
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger

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

    def plan(self) -> Any:
        """Call /plan_door_impact for 0.4 rad; the plan."""
        answer = self.ask(desired_opening_angle=0.4)
        assert answer.success, answer.message
        return answer.plan

    def forget(self) -> Any:
        """Call /forget_hits."""
        future = self.forgetting.call_async(Trigger.Request())
        self.until(future.done)
        return future.result()

    def report(self, plan: Any, share: float, **fields: Any) -> None:
        """Publish a report of a hit that opened the door to a share of the desired angle."""
        self.reports.publish(HitReport(**{
            "plan_id": plan.plan_id, "door": plan.door, "contact_delay": 0.004,
            "peak_angle": share * plan.desired_opening_angle,
            "switch_latency": plan.switch_time - plan.contact_time, "v_rb_post": math.nan,
            **fields}))


@contextmanager
def running(*parameters: str) -> Iterator[Rig]:
    """A rig on its own domain, whose planner has parameters NAME:=VALUE."""
    rclpy.init(args=["--ros-args", *(word for each in parameters for word in ("-p", each))])
    made = Rig()
    try:
        made.until(lambda: made.client.service_is_ready() and made.forgetting.service_is_ready()
                   and made.reports.get_subscription_count() > 0)
        yield made
    finally:
        made.executor.shutdown()
        made.node.destroy_node()
        made.other.destroy_node()
        rclpy.shutdown()


def closer(known: Any) -> CloserParameters:
    """The message of an identifier for the paper's door."""
    door = known.door
    return CloserParameters(
        door="identified", i_a=door.i_a, c_c=door.c_c, k_c=door.k_c,
        tau_c0_prime=door.tau_c0_prime, link_l=door.closer.l, link_l1=door.closer.l1,
        link_l2=door.closer.l2, link_l3=door.closer.l3, theta_i0=door.closer.theta_i0,
        leaf_width=known.width,
    )  # fmt: skip


def test_a_plan_needs_a_door_and_refusals_leave_the_last_plan_alone(known: Any) -> None:
    """Every kind of refusal has its code; plans on the topic have trajectories."""
    with running() as rig:
        answer = rig.ask(desired_opening_angle=0.4)
        assert (answer.success, answer.error_code) == (False, Answer.NO_DOOR)
        assert "/identify_closer" in answer.message
        rig.closer.publish(closer(known))
        rig.until(lambda: rig.node._identified is not None)
        good = rig.ask(desired_opening_angle=math.radians(25.0))
        assert good.success, good.message
        assert good.plan.omega_door == pytest.approx(0.635, abs=1e-3)
        assert (good.plan.door, len(good.plan.phases)) == ("identified", 0)
        for fields, code in (
            ({"desired_opening_angle": math.nan}, Answer.INVALID_REQUEST),
            ({"desired_opening_angle": 3.0}, Answer.ANGLE_UNREACHABLE),
            ({"desired_opening_angle": 1.1}, Answer.SPEED_UNREACHABLE),
            ({"desired_opening_angle": 0.4, "door_distance": 2.0}, Answer.POSTURE_UNREACHABLE),
        ):
            answer = rig.ask(**fields)
            assert (answer.success, answer.error_code) == (False, code), answer.message
            assert answer.message
        again = rig.ask(desired_opening_angle=0.3, include_trajectories=True)
        assert len(again.plan.phases) == 7
        rig.until(lambda: len(rig.plans) == 2)
        assert [plan.plan_id for plan in rig.plans] == [good.plan.plan_id, again.plan.plan_id]
        assert [phase.name for phase in rig.plans[0].phases][-3:] == ["cam", "post", "hold"]


def test_a_door_hinged_at_the_left_is_hit_with_the_left_elbow(tmp_path: Path) -> None:
    """The plan is the mirror image, in the robot's own joints; so is that of an identified one."""
    paper, path = load_door("paper"), tmp_path / "door.yaml"
    path.write_text(replace(paper, hinge="left").to_yaml())
    found = []
    for parameters in (["door:=paper"], [f"frame_of:={path}"]):
        with running(*parameters) as rig:
            if rig.node._configured is None:
                message = closer(KnownDoor.configured(paper))
                message.door = paper.name
                rig.closer.publish(message)
                rig.until(lambda rig=rig: rig.node._identified is not None)
            found.append(rig.ask(desired_opening_angle=0.4, include_trajectories=True).plan)
    right, left = found
    assert left.v_rb == pytest.approx(right.v_rb, rel=1e-3)
    assert left.brace_joint == right.brace_joint.replace("RARM", "LARM")
    assert (left.contact_point.x, left.contact_point.y) == pytest.approx(
        (-right.contact_point.x, right.contact_point.y), abs=1e-6)
    assert left.left_foot.position.y == pytest.approx(right.right_foot.position.y, abs=1e-6)
    assert left.left_foot.orientation.z == 1.0
    elbow = [dict(zip(last.joint_names, last.points[-1].positions, strict=True))
             for last in (plan.phases[4].trajectory for plan in found)]
    for joint, sign in (("ARM_JOINT3", 1.0), ("ARM_JOINT2", -1.0), ("LEG_JOINT1", -1.0)):
        assert elbow[1]["L" + joint] == pytest.approx(sign * elbow[0]["R" + joint], abs=1e-6)


def test_parameters_change_the_next_plan_or_are_refused() -> None:
    """A configured door makes plans possible, and a bad value changes nothing."""
    with running("door:=paper") as rig:
        before = rig.plan()
        assert before.restitution == 0.5
        assert rig.node.set_parameters([Parameter("restitution", value=0.7)])[0].successful
        refused = rig.node.set_parameters([Parameter("restitution", value=7.0)])[0]
        assert not refused.successful
        assert "restitution" in refused.reason
        assert not rig.node.set_parameters([Parameter("door", value="no_such_door")])[0].successful
        after = rig.plan()
        assert after.restitution == 0.7
        assert after.v_rb < before.v_rb


def test_a_hit_changes_the_next_plan_outlives_the_node_and_is_forgotten_on_request(
        tmp_path: Path, capfd: Any) -> None:
    """Only a plausible hit of the last plan counts; after a peak 10 % too high v_rB is lower."""
    path = tmp_path / "deep" / "hits.yaml"
    parameters = ("door:=paper", f"experience_file:={path}")
    with running(*parameters) as rig:
        first = rig.plan()
        assert first.learned_hits == 0
        rig.report(first, plan_id="another", share=1.1)
        rig.report(first, share=math.nan)
        rig.report(first, share=1e-3)
        rig.report(first, share=1.1, error_code=ExecuteDoorImpact.Result.STOPPED)
        rig.report(first, share=1.1)
        rig.until(path.exists)
        second = rig.plan()
        assert second.learned_hits == 1
        assert 0.9 * first.v_rb < second.v_rb < 0.97 * first.v_rb
        assert second.omega_door == first.omega_door
        captured = capfd.readouterr()
        log = captured.out + captured.err
        assert log.count("nothing was learned from the hit of plan") == 4
        rig.report(first, share=1.1)  # it is no longer the last plan
    with running(*parameters) as rig:
        again = rig.plan()
        assert (again.plan_id, again.learned_hits) == (second.plan_id, 1)
        assert [rig.forget().message for _ in range(2)] == [
            "the hits on paper were forgotten", "no hit has taught anything yet"]
        third = rig.plan()
        assert (third.plan_id, third.learned_hits) == (first.plan_id, 0)
    with running(*parameters) as rig:
        assert rig.plan().plan_id == first.plan_id


@pytest.mark.parametrize("named", ["restitution", "hits.yaml"])
def test_a_bad_parameter_or_file_of_hits_ends_the_node_in_one_line(
        tmp_path: Path, capfd: pytest.CaptureFixture[str], named: str) -> None:
    """The node neither plans without the experience nor overwrites the file."""
    path = tmp_path / "hits.yaml"
    path.write_text("paper: {hits: 1, mass_factor: 1.0, restitution: 2.0, covariance: []}\n")
    before = path.read_bytes()
    bad = "restitution:=2.0" if named == "restitution" else f"experience_file:={path}"
    assert main(["--ros-args", "-p", bad]) == 1
    (error,) = (line for line in capfd.readouterr().err.splitlines() if line.strip())
    assert named in error
    assert path.read_bytes() == before

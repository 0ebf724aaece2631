"""Node impact_planner, talking over the middleware."""

import math
import os
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

rclpy = pytest.importorskip("rclpy")

from door_impact_msgs.msg import CloserParameters, ImpactPlan  # noqa: E402
from door_impact_msgs.srv import PlanDoorImpact  # noqa: E402
from impact_planner.impact_planner_node import ImpactPlanner, main  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402

Answer = PlanDoorImpact.Response
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Rig:
    """The planner beside a node that plays the identifier and asks."""

    def __init__(self) -> None:
        self.node = ImpactPlanner()
        self.other = rclpy.create_node("other")
        self.closer = self.other.create_publisher(CloserParameters, "/closer_parameters", LATCHED)
        self.client = self.other.create_client(PlanDoorImpact, "/plan_door_impact")
        self.plans: list[ImpactPlan] = []
        self.other.create_subscription(ImpactPlan, "/door_impact_plan", self.plans.append, LATCHED)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.executor.add_node(self.other)

    def until(self, done: Callable[[], bool]) -> None:
        """Spin until something has happened; a limit keeps a failing test from hanging."""
        limit = time.monotonic() + 30.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            self.executor.spin_once(timeout_sec=0.05)

    def ask(self, **fields: Any) -> Any:
        """Call /plan_door_impact."""
        future = self.client.call_async(PlanDoorImpact.Request(**fields))
        self.until(future.done)
        return future.result()


@pytest.fixture
def rig() -> Iterator[Rig]:
    """A rig on a domain of its own."""
    rclpy.init(domain_id=50 + os.getpid() % 50)
    made = Rig()
    made.until(made.client.service_is_ready)
    yield made
    made.executor.shutdown()
    made.node.destroy_node()
    made.other.destroy_node()
    rclpy.shutdown()


def closer(known: Any) -> CloserParameters:
    """What an identifier would say of the paper's door."""
    door = known.door
    return CloserParameters(
        door="identified", i_a=door.i_a, c_c=door.c_c, k_c=door.k_c,
        tau_c0_prime=door.tau_c0_prime, link_l=door.closer.l, link_l1=door.closer.l1,
        link_l2=door.closer.l2, link_l3=door.closer.l3, theta_i0=door.closer.theta_i0,
        leaf_width=known.width,
    )  # fmt: skip


def test_without_a_door_there_is_no_plan_and_with_one_there_is(rig: Rig, known: Any) -> None:
    """NO_DOOR first; after /closer_parameters a plan, whole on the topic, short in the answer."""
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
    """Every kind of bad request is answered; nothing is published for it."""
    rig.closer.publish(closer(known))
    rig.until(lambda: rig.node._identified is not None)
    good = rig.ask(desired_opening_angle=0.4, include_trajectories=True)
    assert len(good.plan.phases) == 7
    rig.until(lambda: len(rig.plans) == 1)
    for fields, code in (
        ({"desired_opening_angle": math.nan}, Answer.INVALID_REQUEST),
        ({"desired_opening_angle": 0.0}, Answer.INVALID_REQUEST),
        ({"desired_opening_angle": -1.0}, Answer.INVALID_REQUEST),
        ({"desired_opening_angle": 0.4, "restitution": 2.0}, Answer.INVALID_REQUEST),
        ({"desired_opening_angle": 3.0}, Answer.ANGLE_UNREACHABLE),
        ({"desired_opening_angle": 1.1}, Answer.SPEED_UNREACHABLE),
        ({"desired_opening_angle": 0.4, "door_distance": 2.0}, Answer.POSTURE_UNREACHABLE),
        ({"desired_opening_angle": 0.4, "ending": "dance"}, Answer.INVALID_REQUEST),
    ):
        answer = rig.ask(**fields)
        assert not answer.success, fields
        assert answer.error_code == code, answer.message
        assert answer.message
    again = rig.ask(desired_opening_angle=0.3)
    rig.until(lambda: len(rig.plans) == 2)
    assert [plan.plan_id for plan in rig.plans] == [good.plan.plan_id, again.plan.plan_id]


def test_parameters_change_the_next_plan_or_are_refused(rig: Rig) -> None:
    """A configured door makes plans possible; a bad value changes nothing."""
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


@pytest.mark.parametrize(
    ("assignment", "reason"),
    [
        ("restitution:=2.0", "restitution"),
        ("door:=no_such_door", "no_such_door"),
        ("run_up:=sprint", "run_up"),
        ("hinge_x:=far", "hinge_x"),
    ],
)
def test_a_bad_parameter_ends_the_node_with_a_message(
    capfd: pytest.CaptureFixture[str], monkeypatch: Any, assignment: str, reason: str
) -> None:
    """Exit code 1 and one sentence, no traceback."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(50 + os.getpid() % 50))
    assert main(["--ros-args", "-p", assignment]) == 1
    found = capfd.readouterr().err
    assert reason in found
    assert "Traceback" not in found

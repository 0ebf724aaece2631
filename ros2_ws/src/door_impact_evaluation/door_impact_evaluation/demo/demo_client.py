"""Use the nodes as a person would: push the door, request identification, plan and hit."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from door_impact_common.node import executor_of
from door_impact_common.stamps import seconds
from door_impact_msgs.action import ExecuteDoorImpact, WalkThroughDoor
from door_impact_msgs.msg import CloserParameters, EncoderSamples, ImpactPlan
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from geometry_msgs.msg import PointStamped
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from robot_driver.intake import present
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from door_impact_evaluation.errors import DemoError

_PUSHED_PEAKS_DEG = (12.0, 16.0, 20.0, 25.0, 30.0)  # angles that the pushes by hand aim at [deg]
_FIRST_PUSH = 5.0      # angular impulse of the first push; the next ones use the peaks seen [N m s]
_PUSH_DURATION = 0.15  # duration of each push [s]
_CLOSED = np.radians(0.2)  # opening angle below which the door counts as closed [rad]
_started = time.monotonic()  # time at which this process began, on the monotonic clock [s]


def wall_time() -> float:
    """Return the wall time since this process began [s]."""
    return time.monotonic() - _started


def report_progress(text: str) -> None:
    """Print a line of progress with the wall time since this process began."""
    print(f"[{wall_time():6.1f} s] {text}", flush=True)


class DemoClient(Node):
    """Uses the other nodes as a person would, and keeps what they publish.

    Args:
        nodes_alive: Reports whether the launcher of the nodes still runs.

    Attributes:
        plan: Last message on /door_impact_plan.
        door: Stamp [s] and opening angle [rad] of each message on /door_angle.
        zmp: Stamp [s], x and y in odom [m] of each message on /zmp.
        samples: Messages on /door_encoder/samples.
        phases: Time of the first feedback [s] and name of each phase of the motion.
    """

    def __init__(self, nodes_alive: Callable[[], bool] = lambda: True) -> None:
        super().__init__("demo_runner", parameter_overrides=[Parameter("use_sim_time", value=True)])
        self._nodes_alive = nodes_alive
        self._callbacks = executor_of(self)
        self._push = self.create_client(PushDoor, "sim/push_door")
        self._identify = self.create_client(IdentifyCloser, "identify_closer")
        self._plan = self.create_client(PlanDoorImpact, "plan_door_impact")
        self._reset = self.create_client(Trigger, "sim/reset")
        self._save_log = self.create_client(Trigger, "hrp2_sim_bridge/save_log")
        self._execute = ActionClient(self, ExecuteDoorImpact, "execute_door_impact")
        self._through = ActionClient(self, WalkThroughDoor, "walk_through_door")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(ImpactPlan, "door_impact_plan", self._on_plan, latched)
        self.create_subscription(JointState, "door_angle", self._on_door, 100)
        self.create_subscription(PointStamped, "zmp", self._on_zmp, 200)
        self.create_subscription(EncoderSamples, "door_encoder/samples", self._on_samples, 200)
        self.plan: ImpactPlan | None = None
        self.door: list[tuple[float, float]] = []
        self.zmp: list[tuple[float, float, float]] = []
        self.samples: list[EncoderSamples] = []
        self.phases: list[tuple[float, str]] = []

    def _on_plan(self, message: ImpactPlan) -> None:
        self.plan = message

    def _on_door(self, message: JointState) -> None:
        self.door.append((seconds(message.header.stamp), message.position[0]))

    def _on_zmp(self, message: PointStamped) -> None:
        self.zmp.append((seconds(message.header.stamp), message.point.x, message.point.y))

    def _on_samples(self, message: EncoderSamples) -> None:
        self.samples.append(message)

    def _on_feedback(self, message: Any) -> None:
        feedback = message.feedback
        phase = getattr(feedback, "hit_phase", "") or feedback.phase
        if phase == "plan":  # nothing moves
            return
        if not self.phases or self.phases[-1][1] != phase:
            self.phases.append((self.now(), phase))
            report_progress(f"    {phase}")

    def now(self) -> float:
        """Return the graph's time [s]; stamps tell it between two messages on /clock."""
        clock = self.get_clock().now().nanoseconds * 1e-9
        return present(clock, *(stamp for stamp, *_ in self.zmp[-1:]))

    def until(self, condition: Callable[[], bool], what: str, timeout: float) -> None:
        """Spin until a condition holds.

        Args:
            condition: Function that is called after every message.
            what: Name of what is waited for, for the error.
            timeout: Longest wall time to wait [s].

        Raises:
            DemoError: The nodes have ended, or the timeout has passed.
        """
        end = time.monotonic() + timeout
        while not condition():
            if not self._nodes_alive():
                raise DemoError(f"a node ended while waiting for {what}")
            if time.monotonic() > end:
                raise DemoError(f"waited {timeout:.0f} s for {what}: see nodes.log")
            self._callbacks.spin_once(timeout_sec=0.1)

    def _demand(self, client: Any, request: Any, failure: str, timeout: float = 60.0) -> Any:
        """Call a service and return its response.

        Args:
            client: Client of the service.
            request: Request to send.
            failure: What it means if the service refuses, for the error.
            timeout: Longest wall time to wait for the response [s].

        Raises:
            DemoError: The service is not there, does not respond in time, or refuses.
        """
        self.until(client.service_is_ready, f"the service {client.service_name}", 30.0)
        future = client.call_async(request)
        self.until(future.done, f"the response of {client.service_name}", timeout)
        response = future.result()
        if not response.success:
            raise DemoError(f"{failure}: {response.message}")
        return response

    def wait_for_graph(self) -> None:
        """Wait until robot, door and executor are there and simulated time runs.

        Raises:
            DemoError: One of them does not appear in time.
        """
        self.until(lambda: bool(self.door) and bool(self.zmp), "door_angle and zmp", 60.0)
        self.until(self._execute.server_is_ready, "the action execute_door_impact", 30.0)
        start = self.now()
        self.until(partial(self._is_past, start + 0.5), "half a second of simulated time", 30.0)

    def push_by_hand(self) -> list[float]:
        """Push the door several times and let it fall shut after each push.

        Returns:
            Largest opening angle after each push [rad].

        Raises:
            DemoError: A push was refused, or the door did not fall shut.
        """
        peaks: list[float] = []
        impulse = _FIRST_PUSH
        for wanted in np.radians(_PUSHED_PEAKS_DEG):
            if peaks:  # against a constant torque the peak grows with the impulse's square
                impulse *= float(np.clip(np.sqrt(wanted / max(peaks[-1], 0.01)), 0.6, 1.6))
            push = PushDoor.Request(impulse=impulse, duration=_PUSH_DURATION)
            first = len(self.door)  # on a busy computer the answer may come after the peak
            self._demand(self._push, push, "the push was refused")
            start = self.now()
            self.until(partial(self._is_past, start + 1.0), "the swing", 60.0)
            self.until(self._door_at_rest, "the door to fall shut", 60.0)
            peaks.append(max(angle for _, angle in self.door[first:]))
            report_progress(f"    push {len(peaks)} of {len(_PUSHED_PEAKS_DEG)}: {impulse:.1f} "
                            f"N m s, up to {np.degrees(peaks[-1]):.1f} deg")
        return peaks

    def _is_past(self, time: float) -> bool:
        return self.now() > time

    def _door_at_rest(self) -> bool:
        recent = [angle for stamp, angle in self.door[-40:] if stamp > self.now() - 0.35]
        return len(recent) > 15 and max(recent) < _CLOSED

    def identify(self) -> CloserParameters:
        """Request the identification of the door from the pushes, and return its parameters.

        Raises:
            DemoError: The door could not be identified.
        """
        return self._demand(self._identify, IdentifyCloser.Request(),
                            "the door could not be identified", timeout=120.0).parameters

    def make_plan(self, target: float, ending: str, run_up: str) -> tuple[ImpactPlan, float]:
        """Request a plan.

        Args:
            target: Desired opening angle [rad].
            ending: Motion after the door's peak, hold, retreat or pass.
            run_up: Profile of the run-up, mcv50 or zmp_limited.

        Returns:
            The plan with its trajectories, and the wall time that the service took [ms].

        Raises:
            DemoError: There is no such plan.
        """
        request = PlanDoorImpact.Request(
            desired_opening_angle=target, ending=ending, run_up=run_up)
        started = time.perf_counter()
        response = self._demand(self._plan, request, "no plan")
        elapsed = 1e3 * (time.perf_counter() - started)
        self.until(lambda: self.plan is not None and self.plan.plan_id == response.plan.plan_id,
                   "the plan on door_impact_plan", 30.0)
        assert self.plan is not None
        return self.plan, elapsed

    def execute(self, plan_id: str) -> Any:
        """Execute a plan and return the result of the action.

        Args:
            plan_id: Identifier of the plan.

        Raises:
            DemoError: The executor refused the plan, or the motion did not end in time.
        """
        return self._moved(self._execute, ExecuteDoorImpact.Goal(plan_id=plan_id), 240.0)

    def walk_through(self, target: float, run_up: str) -> Any:
        """Hit the door, walk through it, and return the result of the action.

        Args:
            target: Opening angle of the hit [rad].
            run_up: Profile of its run-up, mcv50 or zmp_limited.

        Raises:
            DemoError: The goal was rejected, or the motion did not end in time.
        """
        goal = WalkThroughDoor.Goal(hit_angle=target, run_up=run_up, include_trajectories=True)
        return self._moved(self._through, goal, 600.0)

    def _moved(self, client: ActionClient, goal: Any, timeout: float) -> Any:
        """Send a goal, and return its result, for which to wait up to a wall time [s]."""
        self.until(client.server_is_ready, "the action's server", 30.0)
        sent = client.send_goal_async(goal, feedback_callback=self._on_feedback)
        self.until(sent.done, "the action's server to accept the goal", 30.0)
        handle = sent.result()
        if not handle.accepted:
            raise DemoError("the goal was refused: see nodes.log")
        result = handle.get_result_async()
        self.until(result.done, "the motion to end", timeout)
        return result.result().result

    def pause(self, duration: float) -> None:
        """Let simulated time [s] pass.

        Raises:
            DemoError: The nodes have ended, or time does not pass.
        """
        self.until(partial(self._is_past, self.now() + duration), "simulated time", 60.0)

    def start_again(self) -> None:
        """Put robot and door back to the start; the planner keeps what it has learned.

        Raises:
            DemoError: The simulation was not reset.
        """
        before = self.now()
        self._demand(self._reset, Trigger.Request(), "the simulation was not reset")
        self.until(lambda: self.now() < before, "the clock to go back", 30.0)
        self.door, self.zmp, self.phases = [], [], []
        self.wait_for_graph()

    def save_log(self) -> None:
        """Make the simulation write its log.

        Raises:
            DemoError: The log was not written.
        """
        self._demand(self._save_log, Trigger.Request(), "the simulation's log was not written")

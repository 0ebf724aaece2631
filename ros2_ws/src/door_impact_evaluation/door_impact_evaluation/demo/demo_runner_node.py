"""The demonstration as a client of the nodes: pushes, identification, plan, hit, evaluation."""

import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from door_impact_common.errors import SettingError
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import CloserParameters, EncoderSamples, ImpactPlan
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from geometry_msgs.msg import PointStamped
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from door_impact_evaluation.errors import DemoError, NodeEndedError

NODES = ("hrp2_sim_bridge", "zmp_publisher", "door_encoder", "closer_identifier", "impact_planner",
         "impact_executor", "scene_publisher", "recorder")
PUSHED_PEAKS_DEG = (12.0, 16.0, 20.0, 25.0, 30.0)  # where the hand tries to push the door to
FIRST_PUSH = 5.0      # [N m s]; the hand learns from how far the door went
PUSH_DURATION = 0.15  # [s]
CLOSED = np.radians(0.2)


def seconds(stamp: Any) -> float:
    """A message's stamp in seconds."""
    return stamp.sec + 1e-9 * stamp.nanosec


class DemoRunner(Node):
    """Drives the other nodes as a user would, and listens to their topics."""

    def __init__(self, nodes_alive: Callable[[], bool] = lambda: True) -> None:
        """Creates the clients; `nodes_alive` tells whether the nodes' launcher still runs."""
        super().__init__("demo_runner", parameter_overrides=[Parameter("use_sim_time", value=True)])
        self._nodes_alive = nodes_alive
        self._push = self.create_client(PushDoor, "/sim/push_door")
        self._identify = self.create_client(IdentifyCloser, "/identify_closer")
        self._plan = self.create_client(PlanDoorImpact, "/plan_door_impact")
        self._reset = self.create_client(Trigger, "/sim/reset")
        self._save_log = self.create_client(Trigger, "/hrp2_sim_bridge/save_log")
        self._execute = ActionClient(self, ExecuteDoorImpact, "/execute_door_impact")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(ImpactPlan, "/door_impact_plan", self._on_plan, latched)
        self.create_subscription(JointState, "/door_angle", self._on_door, 100)
        self.create_subscription(PointStamped, "/zmp", self._on_zmp, 200)
        self.create_subscription(EncoderSamples, "/door_encoder/samples", self._on_samples, 200)
        self.plan: ImpactPlan | None = None
        self.door: list[tuple[float, float]] = []         # stamp [s], angle [rad]
        self.zmp: list[tuple[float, float, float]] = []   # stamp [s], x, y [m]
        self.samples: list[EncoderSamples] = []
        self.phases: list[tuple[float, str]] = []         # first feedback of each phase, stamp [s]

    def _on_plan(self, message: ImpactPlan) -> None:
        self.plan = message

    def _on_door(self, message: JointState) -> None:
        self.door.append((seconds(message.header.stamp), message.position[0]))

    def _on_zmp(self, message: PointStamped) -> None:
        self.zmp.append((seconds(message.header.stamp), message.point.x, message.point.y))

    def _on_samples(self, message: EncoderSamples) -> None:
        self.samples.append(message)

    def _on_feedback(self, message: Any) -> None:
        phase = message.feedback.phase
        if not self.phases or self.phases[-1][1] != phase:
            self.phases.append((self.now(), phase))
            say(f"    {phase}")

    def now(self) -> float:
        """The graph's time [s]."""
        return self.get_clock().now().nanoseconds * 1e-9

    def until(self, condition: Callable[[], bool], what: str, timeout: float) -> None:
        """Spins until a condition holds.

        Args:
            condition: Checked after every message.
            what: What is waited for, for the error.
            timeout: Wall time [s].

        Raises:
            DemoError: The nodes have ended, or time is up.
        """
        end = time.monotonic() + timeout
        while not condition():
            if not self._nodes_alive():
                raise NodeEndedError(f"a node ended while waiting for {what}")
            if time.monotonic() > end:
                raise DemoError(f"waited {timeout:.0f} s for {what}: see nodes.log")
            rclpy.spin_once(self, timeout_sec=0.1)

    def call(self, client: Any, request: Any, timeout: float = 60.0) -> Any:
        """Calls a service and returns its answer."""
        self.until(client.service_is_ready, f"the service {client.srv_name}", 30.0)
        future = client.call_async(request)
        self.until(future.done, f"the answer of {client.srv_name}", timeout)
        return future.result()

    def wait_for_graph(self) -> None:
        """Waits until robot, door and every node are there."""
        self.until(lambda: bool(self.door) and bool(self.zmp), "/door_angle and /zmp", 60.0)
        self.until(self._execute.server_is_ready, "the action /execute_door_impact", 30.0)
        start = self.now()
        self.until(partial(self._is_past, start + 0.5), "half a second of simulated time", 30.0)

    def push_by_hand(self) -> list[float]:
        """Pushes the door several times and lets it fall shut.

        Returns:
            The peaks [rad].
        """
        peaks: list[float] = []
        impulse = FIRST_PUSH
        for wanted in np.radians(PUSHED_PEAKS_DEG):
            if peaks:  # against a constant torque the peak grows with the impulse's square
                impulse *= float(np.clip(np.sqrt(wanted / max(peaks[-1], 0.01)), 0.6, 1.6))
            push = PushDoor.Request(impulse=impulse, duration=PUSH_DURATION)
            answer = self.call(self._push, push)
            if not answer.success:
                raise DemoError(f"the push was refused: {answer.message}")
            first, start = len(self.door), self.now()
            self.until(partial(self._is_past, start + 1.0), "the swing", 60.0)
            self.until(self._door_at_rest, "the door to fall shut", 60.0)
            peaks.append(max(angle for _, angle in self.door[first:]))
            say(f"    push {len(peaks)} of {len(PUSHED_PEAKS_DEG)}: {impulse:.1f} N m s, "
                f"up to {np.degrees(peaks[-1]):.1f} deg")
        return peaks

    def _is_past(self, time: float) -> bool:
        return self.now() > time

    def _door_at_rest(self) -> bool:
        recent = [angle for stamp, angle in self.door[-40:] if stamp > self.now() - 0.35]
        return len(recent) > 15 and max(recent) < CLOSED

    def identify(self) -> CloserParameters:
        """Asks for the closer's parameters."""
        answer = self.call(self._identify, IdentifyCloser.Request(), timeout=120.0)
        if not answer.success:
            raise DemoError(f"identification: {answer.message}")
        return answer.parameters

    def make_plan(self, target: float, ending: str, run_up: str) -> tuple[ImpactPlan, float]:
        """Asks for a plan.

        Args:
            target: Desired opening angle [rad].
            ending: hold or retreat.
            run_up: mcv50 or zmp_limited.

        Returns:
            The plan with its trajectories, and how long the service took [ms].
        """
        request = PlanDoorImpact.Request(
            desired_opening_angle=target, ending=ending, run_up=run_up)
        started = time.perf_counter()
        answer = self.call(self._plan, request)
        elapsed = 1e3 * (time.perf_counter() - started)
        if not answer.success:
            raise DemoError(f"no plan: {answer.message}")
        self.until(lambda: self.plan is not None and self.plan.plan_id == answer.plan.plan_id,
                   "the plan on /door_impact_plan", 30.0)
        assert self.plan is not None
        return self.plan, elapsed

    def execute(self, plan_id: str) -> Any:
        """Runs a plan and returns the action's result."""
        sent = self._execute.send_goal_async(
            ExecuteDoorImpact.Goal(plan_id=plan_id), feedback_callback=self._on_feedback)
        self.until(sent.done, "the executor to take the goal", 30.0)
        handle = sent.result()
        if not handle.accepted:
            raise DemoError("the executor refused the goal: see nodes.log")
        result = handle.get_result_async()
        self.until(result.done, "the motion to end", 240.0)
        return result.result().result

    def start_again(self) -> None:
        """Puts robot and door back to the start; what the planner has learned stays."""
        answer = self.call(self._reset, Trigger.Request())
        if not answer.success:
            raise DemoError(f"the simulation was not reset: {answer.message}")
        self.door, self.zmp, self.phases = [], [], []
        self.wait_for_graph()

    def save_log(self) -> None:
        """Lets the simulation write its log."""
        answer = self.call(self._save_log, Trigger.Request())
        if not answer.success:
            raise DemoError(f"the simulation's log was not written: {answer.message}")


_started = time.monotonic()


def say(text: str) -> None:
    """Prints a line of progress with the wall time since the start."""
    print(f"[{time.monotonic() - _started:6.1f} s] {text}", flush=True)


def refuse_running_graph() -> None:
    """Raises an error where the demonstration's nodes run already.

    Raises:
        DemoError: Names the nodes.
    """
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # signals are the caller's
    try:
        node = Node("demo_check")
        end = time.monotonic() + 1.0  # discovery
        while time.monotonic() < end:
            rclpy.spin_once(node, timeout_sec=0.1)
        running = sorted(set(node.get_node_names()) & set(NODES))
        node.destroy_node()
    finally:
        rclpy.shutdown()
    if running:
        raise DemoError(f"already running: {', '.join(running)}. Stop `make up` or the other "
                        "demonstration first, or set another ROS_DOMAIN_ID")


def run(*, door: str, target_deg: float, ending: str, run_up: str, hits: int, out: Path,
        nodes_alive: Callable[[], bool] = lambda: True, args: Sequence[str] = ()) -> None:
    """Runs the demonstration against nodes that were started elsewhere.

    Args:
        door: Name of the simulated door or its YAML file, for the comparison with the truth.
        target_deg: Desired opening angle [deg].
        ending: hold or retreat.
        run_up: mcv50 or zmp_limited.
        hits: How often the door is hit, from the start each time; the results are the last one's.
        out: Folder of the results.
        nodes_alive: Tells whether the nodes' launcher still runs.
        args: ROS arguments.

    Raises:
        DemoError: Something failed; the message says what.
    """
    from door_impact_evaluation.demo import results
    from door_impact_evaluation.demo.received import Received

    rclpy.init(args=list(args) or None, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = DemoRunner(nodes_alive)
        say("waiting for the nodes")
        node.wait_for_graph()
        began, simulated = time.perf_counter(), -node.now()
        say("pushing the door by hand")
        node.push_by_hand()
        say("identifying the closer")
        parameters = node.identify()
        samples = tuple(node.samples)  # of the pushes; the robot's own hit comes later
        for number in range(1, hits + 1):
            if number > 1:
                say("back to the start, to hit the door again")
                simulated += node.now()
                node.start_again()
                simulated -= node.now()
            plan, planning_ms, outcome = _hit(node, target_deg, ending, run_up)
            if not outcome.success:
                break
        real_time_factor = (simulated + node.now()) / (time.perf_counter() - began)
        node.save_log()
        say("drawing the figures and the animation")
        try:
            results.write(Received(
                door=door, target_deg=target_deg, parameters=parameters, plan=plan,
                outcome=outcome, planning_ms=planning_ms, real_time_factor=real_time_factor,
                wall_s=time.monotonic() - _started, door_angle=np.array(node.door),
                zmp=np.array(node.zmp), samples=samples,
                phases=node.phases, end=node.now()), out)
        except DemoError as error:
            if outcome.success:
                raise
            raise DemoError(f"{error}: {outcome.message}") from error
    finally:
        rclpy.try_shutdown()
    if not outcome.success:
        raise DemoError(f"the motion failed: {outcome.message}; see nodes.log")


def _hit(node: DemoRunner, target_deg: float, ending: str, run_up: str) -> tuple[Any, float, Any]:
    """Plans and executes; the plan, how long that took [ms], and the action's result."""
    say(f"planning the hit for {target_deg:g} deg")
    plan, planning_ms = node.make_plan(float(np.radians(target_deg)), ending, run_up)
    for warning in plan.warnings:
        say(f"    note: {warning}")
    if plan.learned_hits:
        say(f"    learned: restitution {plan.restitution:.3f}, effective mass "
            f"{plan.effective_mass:.1f} kg, {plan.effective_mass_model:.1f} by the model")
    say("hitting the door")
    outcome = node.execute(plan.plan_id)
    say(f"    {np.degrees(outcome.peak_angle):.1f} deg by the encoder; {outcome.message}")
    return plan, planning_ms, outcome


def target_of(node: Node) -> float:
    """Parameter target_deg [deg]; an integer is a number too.

    Raises:
        SettingError: It is no number.
    """
    any_type = ParameterDescriptor(dynamic_typing=True)
    value = node.declare_parameter("target_deg", 25.0, any_type).value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise SettingError("target_deg", value, "a number of degrees")
    return float(value)


def main(args: list[str] | None = None) -> int:
    """The node of demo.launch.yaml; parameters door, target_deg, ending, run_up, hits,
    out_dir."""
    rclpy.init(args=args)
    node = Node("demo_runner")
    try:
        door = node.declare_parameter("door", "paper").value
        target_deg = target_of(node)
        ending = node.declare_parameter("ending", "hold").value
        run_up = node.declare_parameter("run_up", "mcv50").value
        hits = int(node.declare_parameter("hits", 1).value)
        out = Path(node.declare_parameter("out_dir", "out/demo").value)
    except SettingError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    finally:
        node.destroy_node()
        rclpy.shutdown()
    out.mkdir(parents=True, exist_ok=True)
    try:
        run(door=door, target_deg=target_deg, ending=ending, run_up=run_up, hits=hits,
            out=out)
    except DemoError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())

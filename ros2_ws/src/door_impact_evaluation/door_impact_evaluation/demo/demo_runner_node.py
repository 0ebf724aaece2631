"""The demonstration as a client of the nodes: pushes, identification, plan, hit, evaluation."""

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from door_impact_common.errors import DoorImpactError
from door_impact_common.files import make_folder
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import seconds
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import CloserParameters, EncoderSamples, ImpactPlan
from door_impact_msgs.srv import IdentifyCloser, PlanDoorImpact, PushDoor
from geometry_msgs.msg import PointStamped
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from door_impact_evaluation.demo.settings import ENDINGS, RUN_UPS, DemoSettings
from door_impact_evaluation.errors import DemoError

NODES = ("hrp2_sim_bridge", "zmp_publisher", "door_encoder", "closer_identifier", "impact_planner",
         "impact_executor", "scene_publisher", "recorder")
PARAMETERS = {
    "door": ("paper", "simulated door: name of a door in door_model/doors, or a YAML file"),
    "target_deg": (25.0, "desired opening angle [deg]"),
    "ending": ("hold", f"motion after the door's peak: {' or '.join(ENDINGS)}"),
    "run_up": ("mcv50", f"profile of the run-up: {' or '.join(RUN_UPS)}"),
    "hits": (1, "number of hits; the results are those of the last one"),
    "out_dir": ("out/demo", "folder of the results"),
}
"""Default and description of each parameter of the node demo_runner."""
_PUSHED_PEAKS_DEG = (12.0, 16.0, 20.0, 25.0, 30.0)  # angles that the pushes by hand aim at [deg]
_FIRST_PUSH = 5.0      # angular impulse of the first push; the next ones use the peaks seen [N m s]
_PUSH_DURATION = 0.15  # duration of each push [s]
_CLOSED = np.radians(0.2)  # opening angle below which the door counts as closed [rad]
_DISCOVERY = 1.0       # wall time after which every node of a running graph is known [s]


class DemoRunner(Node):
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
        phase = message.feedback.phase
        if not self.phases or self.phases[-1][1] != phase:
            self.phases.append((self.now(), phase))
            report_progress(f"    {phase}")

    def now(self) -> float:
        """Returns the graph's time [s]."""
        return self.get_clock().now().nanoseconds * 1e-9

    def until(self, condition: Callable[[], bool], what: str, timeout: float) -> None:
        """Spins until a condition holds.

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
            rclpy.spin_once(self, timeout_sec=0.1)

    def call(self, client: Any, request: Any, timeout: float = 60.0) -> Any:
        """Calls a service and returns its response.

        Args:
            client: Client of the service.
            request: Request to send.
            timeout: Longest wall time to wait for the response [s].

        Raises:
            DemoError: The service is not there, or does not respond in time.
        """
        self.until(client.service_is_ready, f"the service {client.srv_name}", 30.0)
        future = client.call_async(request)
        self.until(future.done, f"the response of {client.srv_name}", timeout)
        return future.result()

    def wait_for_graph(self) -> None:
        """Waits until robot, door and executor are there and simulated time runs.

        Raises:
            DemoError: One of them does not appear in time.
        """
        self.until(lambda: bool(self.door) and bool(self.zmp), "/door_angle and /zmp", 60.0)
        self.until(self._execute.server_is_ready, "the action /execute_door_impact", 30.0)
        start = self.now()
        self.until(partial(self._is_past, start + 0.5), "half a second of simulated time", 30.0)

    def push_by_hand(self) -> list[float]:
        """Pushes the door several times and lets it fall shut after each push.

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
            response = self.call(self._push, push)
            if not response.success:
                raise DemoError(f"the push was refused: {response.message}")
            first, start = len(self.door), self.now()
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
        """Requests the identification of the door from the pushes, and returns its parameters.

        Raises:
            DemoError: The door could not be identified.
        """
        response = self.call(self._identify, IdentifyCloser.Request(), timeout=120.0)
        if not response.success:
            raise DemoError(f"the door could not be identified: {response.message}")
        return response.parameters

    def make_plan(self, target: float, ending: str, run_up: str) -> tuple[ImpactPlan, float]:
        """Requests a plan.

        Args:
            target: Desired opening angle [rad].
            ending: Motion after the door's peak, hold or retreat.
            run_up: Profile of the run-up, mcv50 or zmp_limited.

        Returns:
            The plan with its trajectories, and the wall time that the service took [ms].

        Raises:
            DemoError: There is no such plan.
        """
        request = PlanDoorImpact.Request(
            desired_opening_angle=target, ending=ending, run_up=run_up)
        started = time.perf_counter()
        response = self.call(self._plan, request)
        elapsed = 1e3 * (time.perf_counter() - started)
        if not response.success:
            raise DemoError(f"no plan: {response.message}")
        self.until(lambda: self.plan is not None and self.plan.plan_id == response.plan.plan_id,
                   "the plan on /door_impact_plan", 30.0)
        assert self.plan is not None
        return self.plan, elapsed

    def execute(self, plan_id: str) -> Any:
        """Executes a plan and returns the result of the action.

        Args:
            plan_id: Identifier of the plan.

        Raises:
            DemoError: The executor refused the plan, or the motion did not end in time.
        """
        sent = self._execute.send_goal_async(
            ExecuteDoorImpact.Goal(plan_id=plan_id), feedback_callback=self._on_feedback)
        self.until(sent.done, "the executor to accept the goal", 30.0)
        handle = sent.result()
        if not handle.accepted:
            raise DemoError("the executor refused the goal: see nodes.log")
        result = handle.get_result_async()
        self.until(result.done, "the motion to end", 240.0)
        return result.result().result

    def start_again(self) -> None:
        """Puts robot and door back to the start; the planner keeps what it has learned.

        Raises:
            DemoError: The simulation was not reset.
        """
        response = self.call(self._reset, Trigger.Request())
        if not response.success:
            raise DemoError(f"the simulation was not reset: {response.message}")
        self.door, self.zmp, self.phases = [], [], []
        self.wait_for_graph()

    def save_log(self) -> None:
        """Makes the simulation write its log.

        Raises:
            DemoError: The log was not written.
        """
        response = self.call(self._save_log, Trigger.Request())
        if not response.success:
            raise DemoError(f"the simulation's log was not written: {response.message}")


_started = time.monotonic()  # wall time at which this process began [s]


def report_progress(text: str) -> None:
    """Prints a line of progress with the wall time since the start."""
    print(f"[{time.monotonic() - _started:6.1f} s] {text}", flush=True)


def refuse_running_graph() -> None:
    """Checks that none of the demonstration's nodes is running in this domain.

    Raises:
        DemoError: Some are; the error names them.
    """
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # signals are the caller's
    try:
        node = Node("demo_check")
        end = time.monotonic() + _DISCOVERY
        while time.monotonic() < end:
            rclpy.spin_once(node, timeout_sec=0.1)
        running = sorted(set(node.get_node_names()) & set(NODES))
        node.destroy_node()
    finally:
        rclpy.shutdown()
    if running:
        raise DemoError(f"already running: {', '.join(running)}. Stop `make up` or the other "
                        "demonstration first, or set another ROS_DOMAIN_ID")


def run(settings: DemoSettings, nodes_alive: Callable[[], bool] = lambda: True) -> None:
    """Runs the demonstration with nodes that were started by others, and writes the results.

    Args:
        settings: What to do.
        nodes_alive: Reports whether the launcher of the nodes still runs.

    Raises:
        DemoError: Something failed; the message says what. The results of a motion that failed
            are written nevertheless.
    """
    # Imported here: matplotlib, Pinocchio and PyBullet load while the nodes start.
    from door_impact_evaluation.demo import results
    from door_impact_evaluation.demo.received import Received

    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = DemoRunner(nodes_alive)
        report_progress("waiting for the nodes")
        node.wait_for_graph()
        began, simulated = time.perf_counter(), -node.now()
        report_progress("pushing the door by hand")
        node.push_by_hand()
        report_progress("identifying the closer")
        parameters = node.identify()
        samples = tuple(node.samples)  # of the pushes alone: the hit is still to come
        for number in range(1, settings.hits + 1):
            if number > 1:
                report_progress("back to the start, to hit the door again")
                simulated += node.now()
                node.start_again()
                simulated -= node.now()
            plan, planning_ms, outcome = _hit(node, settings)
            if not outcome.success:
                break
        real_time_factor = (simulated + node.now()) / (time.perf_counter() - began)
        node.save_log()
        report_progress("drawing the figures and the animation")
        try:
            results.write(Received(
                door=settings.door, target_deg=settings.target_deg, parameters=parameters,
                plan=plan, outcome=outcome, planning_ms=planning_ms,
                real_time_factor=real_time_factor, wall_s=time.monotonic() - _started,
                door_angle=np.array(node.door), zmp=np.array(node.zmp), samples=samples,
                phases=node.phases, end=node.now()), settings.out)
        except DemoError as error:
            if outcome.success:
                raise
            raise DemoError(f"{error}: {outcome.message}") from error
    finally:
        rclpy.try_shutdown()
    if not outcome.success:
        raise DemoError(f"the motion failed: {outcome.message}; see report.html and nodes.log")


def _hit(node: DemoRunner, settings: DemoSettings) -> tuple[ImpactPlan, float, Any]:
    """Plans and executes one hit.

    Returns:
        The plan, the wall time of planning [ms], and the result of the action.
    """
    report_progress(f"planning the hit for {settings.target_deg:g} deg")
    plan, planning_ms = node.make_plan(
        float(np.radians(settings.target_deg)), settings.ending, settings.run_up)
    for warning in plan.warnings:
        report_progress(f"    note: {warning}")
    if plan.learned_hits:
        report_progress(f"    learned: restitution {plan.restitution:.3f}, effective mass "
                        f"{plan.effective_mass:.1f} kg, {plan.effective_mass_model:.1f} kg by the "
                        "model")
    report_progress("hitting the door")
    outcome = node.execute(plan.plan_id)
    report_progress(f"    {np.degrees(outcome.peak_angle):.1f} deg by the encoder; "
                    f"{outcome.message}")
    return plan, planning_ms, outcome


def settings_of(node: Node) -> DemoSettings:
    """Declares and reads the parameters of the node demo_runner.

    Args:
        node: The node.

    Raises:
        SettingError: A parameter is out of its range; the error names it.
    """
    parameters = Parameters(node, PARAMETERS)
    return DemoSettings(
        door=parameters.text("door"),
        target_deg=parameters.number("target_deg"),
        ending=parameters.choice("ending", ENDINGS),
        run_up=parameters.choice("run_up", RUN_UPS),
        hits=parameters.whole("hits", low=1),
        out=Path(parameters.text("out_dir")),
    )


def _settings_from_parameters(args: list[str] | None) -> DemoSettings:
    rclpy.init(args=args)
    try:
        node = Node("demo_runner")
        try:
            return settings_of(node)
        finally:
            node.destroy_node()
    finally:
        rclpy.shutdown()


def main(args: list[str] | None = None) -> int:
    """Runs the node of demo.launch.yaml; its parameters are those of `PARAMETERS`.

    Args:
        args: Command line with ROS arguments; None means the process's own.

    Returns:
        0 if the door was opened, 1 if something failed, 130 after Ctrl-C.
    """
    try:
        settings = _settings_from_parameters(args)
        make_folder(settings.out)
        run(settings)
    except DoorImpactError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print(f"See {settings.out / 'report.html'} for the figures and the animation.", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

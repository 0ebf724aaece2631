"""Node ``hrp2_sim_bridge``: the simulated robot with the topics of its driver."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from door_impact_common.errors import OutputError, SettingError
from door_impact_common.node import GuardedNode, executor_of, run_node, spin_for
from door_impact_common.stamps import seconds, stamp_of
from door_impact_msgs.msg import EncoderSamples, HandCompliance
from door_impact_msgs.srv import PushDoor, PushRobot
from door_model.door.config import load_door
from door_model.recording.batch import SampleBatcher
from door_model.ros.messages import to_message
from geometry_msgs.msg import WrenchStamped
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.driver_interface import TickSample
from rclpy.qos import DurabilityPolicy, QoSProfile
from robot_driver.errors import TrajectoryRefusedError
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Header, String
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory

from hrp2_sim_bridge.control.servo import Servo
from hrp2_sim_bridge.errors import SecondDriverError
from hrp2_sim_bridge.log import check_writable
from hrp2_sim_bridge.ros import messages as convert
from hrp2_sim_bridge.ros.parameters import BridgeParameters
from hrp2_sim_bridge.sensors.imu import imu_variances
from hrp2_sim_bridge.sensors.sensors import COUNTS_PER_TURN
from hrp2_sim_bridge.settings import SAMPLE, TICK
from hrp2_sim_bridge.world import World

NAME = "hrp2_sim_bridge"
QUEUE = 50
ENCODER_BATCH = 20  # samples in a message, which makes 50 messages per second
CLOCK_TICKS = 4  # ticks between two messages on /clock, which every node reads: 50 per second
DIAGNOSTICS_TICKS = 40  # ticks between two diagnostics, which makes 5 per second
TICK_NS = round(TICK * 1e9)
_LONGEST_LAG = 0.02  # largest delay that is made up for: in a hurry, nodes would be late [s]
_AHEAD = 0.05  # by how much the simulation is ahead of the node that moves its robot at most [s]
_PATIENCE = 0.5  # real time for which it waits for it [s]
_LOOK = 0.001  # real time between two looks meanwhile [s]
_SHUT = math.radians(0.2)  # angle up to which the door counts as shut [rad]


class Pacer:
    """Computes how long to wait before the next step.

    Args:
        factor: Simulated time per real time; 0 means no limit.
        clock: Function that returns the real time [s].
    """

    def __init__(self, factor: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._factor = factor
        self._clock = clock
        self._due = clock()

    def advance(self, duration: float) -> None:
        """Record that simulated time has advanced by a duration [s]."""
        if self._factor > 0.0:
            self._due = max(self._due + duration / self._factor, self._clock() - _LONGEST_LAG)

    def wait(self) -> float:
        """Return the real time until the next step is due [s]; 0 if it is due now."""
        if self._factor <= 0.0:
            return 0.0
        return max(0.0, self._due - self._clock())


class Company:
    """Tells when the simulation must wait for the node that moves its robot.

    So no node is late because the computer is busy, and a simulation may run as fast as it goes.

    Args:
        clock: Function that returns the real time [s].
        ahead: By how much the simulation is ahead of that node at most [s].
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, ahead: float = _AHEAD
    ) -> None:
        self._clock, self._ahead = clock, ahead
        self.leave()

    def leave(self) -> None:
        """Go on alone: nobody moves the robot."""
        self._stamp, self._since = 0.0, -math.inf

    def handled(self, stamp: float) -> None:
        """Note up to which stamp measurements have been handled [s]; 0: nobody moves the robot."""
        if stamp <= 0.0:
            self.leave()
        elif stamp > self._stamp:
            self._stamp, self._since = stamp, self._clock()

    def waits(self, now: float) -> bool:
        """Whether a simulation at a time [s] must wait; not for a node that comes no farther."""
        return now > self._stamp + self._ahead and self._clock() < self._since + _PATIENCE


class SimBridge(GuardedNode):
    """Steps the world, publishes its samples and passes orders to it.

    Raises:
        SettingError: A parameter is out of its range, or the log cannot be written.
        SimBridgeError: The simulation cannot run.
    """

    def __init__(self) -> None:
        super().__init__(NAME)
        self._options = BridgeParameters(self)
        self._log_file = self._options.text("log_file")
        if self._log_file:
            check_writable(self._log_file)
        self._push_duration = self._options.positive("push_duration")
        self.world = World(
            load_robot_config(self._options.text("robot_config") or None),
            load_door(self._options.text("door")),
            self._options.number("door_distance"),
            self._options.number("hinge_x"),
            **self._options.world_settings())
        self._messages = convert.TickMessages(
            self.world.robot_config, imu_variances(self.world.settings.sensors),
            self._options.text("frame_prefix"))
        self._pacer, self._company = Pacer(self._options.speed()), Company()
        self._controller = Company(ahead=0.5 * TICK)
        self._encoder = SampleBatcher(
            period_ns=round(SAMPLE * 1e9), size=ENCODER_BATCH, counts_per_turn=COUNTS_PER_TURN)
        self._accepted, self._refused = 0, 0
        self._refusal = ""
        self._fall_reported = False
        self._ticks = 0
        self._make_publishers()
        self._pause(False)
        if self.world.settings.servo:
            self.create_subscription(JointState, "sim/joint_commands", self._on_command, QUEUE)
        else:
            self.create_subscription(
                JointTrajectory, "joint_trajectory", self._on_trajectory, QUEUE)
        self.create_subscription(HandCompliance, "hand_compliance", self._on_compliance, QUEUE)
        self.create_subscription(
            Header, "sim/handled", lambda message: self._company.handled(seconds(message.stamp)),
            QUEUE)
        self.create_service(Trigger, "sim/reset", self._on_reset)
        self.create_service(SetBool, "sim/pause", self._on_pause)
        self.create_service(Trigger, "sim/step", self._on_step)
        self.create_service(PushDoor, "sim/push_door", self._on_push)
        self.create_service(PushRobot, "sim/push_robot", self._on_push_robot)
        self.create_service(Trigger, "~/stop", self._on_stop)
        self.create_service(Trigger, "~/save_log", self._on_save_log)

    def _make_publishers(self) -> None:
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._clock_topic = self.create_publisher(Clock, "/clock", QUEUE)
        # Below a controller its broadcaster publishes joint_states.
        self._joints = self.create_publisher(
            JointState, "sim/joint_states" if self.world.settings.servo else "joint_states", QUEUE)
        self._imu = self.create_publisher(Imu, "imu", QUEUE)
        ends = ["foot"] if self.world.robot_config.wrist_sensors is None else ["foot", "wrist"]
        self._wrenches = [
            self.create_publisher(WrenchStamped, f"{side}_{end}/wrench", QUEUE)
            for end in ends for side in SIDES]
        self._counts = self.create_publisher(EncoderSamples, "door_encoder/counts", QUEUE)
        self._paused = self.create_publisher(Bool, "sim/paused", latched)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", QUEUE)
        if not self.world.settings.servo:  # that of ros2_control has tags
            self._description = self.create_publisher(String, "robot_description", latched)
            self._description.publish(
                String(data=self.world.robot_config.urdf_path.read_text(encoding="utf-8")))

    def run(self) -> None:
        """Step the world until the context ends; then write the log if `log_file` is set.

        Raises:
            SecondDriverError: The driver of a robot is in the graph already.
        """
        if self.count_publishers(self._joints.topic_name) > 1:
            raise SecondDriverError(self._joints.topic_name)
        try:
            with executor_of(self) as executor:
                while rclpy.ok():
                    self._publish(self.world.step())
                    self._left -= 1.0
                    self._pacer.advance(TICK)
                    spin_for(executor, self._pacer.wait())
                    while rclpy.ok() and (self._left < 1.0
                                          or self._company.waits(self.world.time)
                                          or self._controller.waits(self.world.time)):
                        spin_for(executor, _LOOK)
        finally:
            self._finish()

    def _now_ns(self) -> int:
        return round(self.world.time / TICK) * TICK_NS

    def _publish(self, sample: TickSample) -> None:
        now, messages = self._now_ns(), self._messages
        messages.fill(now, sample)
        if (self.world.settings.servo or self._left < math.inf
                or self._ticks % CLOCK_TICKS == 0):
            self._clock_topic.publish(Clock(clock=messages.stamp))
        self._joints.publish(messages.joints)
        for publisher, message in zip(self._wrenches, messages.wrenches, strict=True):
            publisher.publish(message)
        self._imu.publish(messages.imu)
        batch = self._encoder.add(sample.counts, now)
        if batch is not None:
            self._counts.publish(to_message(batch))
        self._ticks += 1
        if self._ticks % DIAGNOSTICS_TICKS == 0:
            self._publish_diagnostics()

    def _publish_diagnostics(self) -> None:
        world = self.world
        moving = world.driver.is_moving(world.time)
        level, text = DiagnosticStatus.OK, "following a trajectory" if moving else "holding"
        if self._refusal:
            level, text = DiagnosticStatus.WARN, f"trajectory refused: {self._refusal}"
        if world.fell:
            level, text = DiagnosticStatus.ERROR, f"fell: {world.fall.reason}"
            if not self._fall_reported:
                self.get_logger().error(text)
            self._fall_reported = True
        values = {
            "accepted": self._accepted, "refused": self._refused, "last_refusal": self._refusal,
            "max_tilt_deg": f"{np.degrees(world.fall.max_tilt):.2f}"}
        status = DiagnosticStatus(
            name=f"{self.get_fully_qualified_name()[1:]}: driver",
            hardware_id=world.robot_config.name, level=level, message=text,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])
        message = DiagnosticArray(status=[status])
        message.header.stamp = stamp_of(self._now_ns())
        self._diagnostics.publish(message)

    def _on_trajectory(self, message: JointTrajectory) -> None:
        stamp = seconds(message.header.stamp)
        try:
            self.world.follow(convert.trajectory_arrays(message), stamp)
        except TrajectoryRefusedError as error:
            self._refused += 1
            self._refusal = str(error)
            self.get_logger().error(f"trajectory refused: {error}")
            self._publish_diagnostics()
        else:
            self._accepted += 1
            self._refusal = ""

    def _on_command(self, message: JointState) -> None:
        """Take the command of a controller, which makes one after each message on /clock."""
        order = {name: column for column, name in enumerate(message.name)}
        names = self.world.robot_config.joint_names
        if isinstance(self.world.driver, Servo) and set(names) <= set(order) and len(
                message.position) == len(order):
            self.world.driver.command(np.array([message.position[order[name]] for name in names]))
            self._controller.handled(self.world.time)

    def _on_compliance(self, message: HandCompliance) -> None:
        try:
            self.world.comply(message.side, message.stiffness, message.damping, message.mass)
        except SettingError as error:
            self.get_logger().error(f"hand compliance refused: {error}")

    def _on_stop(self, _: Any, response: Any) -> Any:
        self.world.stop()
        response.success, response.message = True, "braking, then holding still"
        return response

    def _pause(self, paused: bool) -> None:
        """Let time stand still, or go on; who watches over silence is told that it is no fault."""
        self._left = 0.0 if paused else math.inf  # ticks that may be made
        self._paused.publish(Bool(data=paused))

    def _on_pause(self, request: Any, response: Any) -> Any:
        self._pause(request.data)
        response.success, response.message = True, f"now at {self.world.time:.3f} s"
        return response

    def _on_step(self, _: Any, response: Any) -> Any:
        self._left += 1.0
        response.success = self._left < math.inf
        response.message = (f"goes on by {1e3 * TICK:g} ms" if response.success else
                            "the simulation is not paused: call sim/pause first")
        return response

    def _on_reset(self, _: Any, response: Any) -> Any:
        self.world.reset()
        self._pause(False)
        self._company.leave()
        self._controller.leave()
        self._encoder.restart()  # the door is shut, so that door_encoder can take its zero again
        self._refusal, self._fall_reported = "", False
        self._ticks = 0
        self._clock_topic.publish(Clock(clock=stamp_of(self._now_ns())))
        response.success, response.message = True, "back in half-sitting at time 0"
        return response

    def _on_push(self, request: Any, response: Any) -> Any:
        duration = self._push_duration if request.duration < 0.0 else request.duration

        def push() -> str:
            self.world.push_door(request.impulse, duration)
            done = f"{request.impulse:g} N m s over {duration:g} s"
            angle = self.world.door_state.angle
            if angle > _SHUT:
                done += (f"; the door is open by {math.degrees(angle):.1f} deg, and a push for an "
                         "identification should begin with a shut door")
            return done

        return _answer(response, push)

    def _on_push_robot(self, request: Any, response: Any) -> Any:
        impulse = np.array([request.impulse.x, request.impulse.y, request.impulse.z])

        def push() -> str:
            self.world.push_robot(impulse, request.duration)
            return f"{np.linalg.norm(impulse):g} N s over {request.duration:g} s"

        return _answer(response, push)

    def _on_save_log(self, _: Any, response: Any) -> Any:
        if not self._log_file:
            response.success, response.message = False, "the parameter log_file is empty"
            return response
        return _answer(response, lambda: str(self.world.save_log(self._log_file)))

    def _finish(self) -> None:
        """Write the log if `log_file` is set, and release the simulator."""
        try:
            if self._log_file:
                self.world.save_log(self._log_file)
        except OutputError as error:
            print(f"{NAME}: {error}", file=sys.stderr)
        finally:
            self.world.close()


def _answer(response: Any, act: Callable[[], str]) -> Any:
    """Fill a response with what an action says of itself, or why it was refused."""
    try:
        response.message = act()
        response.success = True
    except (SettingError, OutputError) as error:
        response.success, response.message = False, str(error)
    return response


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; return the exit code."""
    return run_node(SimBridge, errors=(OSError,), args=args, spin=SimBridge.run)


if __name__ == "__main__":
    sys.exit(main())

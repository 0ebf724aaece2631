"""Node ``hrp2_sim_bridge``: the simulated HRP-2 with the topics of its driver."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from door_impact_common.errors import OutputError, SettingError
from door_impact_common.node import GuardedNode, executor_of, run_node, spin_for
from door_impact_common.parameters import allowed_folders
from door_impact_common.stamps import seconds, stamp_of
from door_impact_msgs.msg import EncoderSamples
from door_impact_msgs.srv import PushDoor, PushRobot
from door_model.door.config import load_door
from door_model.recording.batch import SampleBatcher
from door_model.ros.messages import to_message
from geometry_msgs.msg import WrenchStamped
from hrp2_description.robot import SIDES, load_robot_config, needed
from humanoid_motion.driver_interface import TickSample
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from hrp2_sim_bridge.errors import SecondDriverError, TrajectoryRefusedError
from hrp2_sim_bridge.log.recorder import check_writable
from hrp2_sim_bridge.ros import messages as convert
from hrp2_sim_bridge.ros.pacer import Pacer
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
_SHUT = math.radians(0.2)  # angle up to which the door counts as shut [rad]


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
        folders = allowed_folders(self)
        self.world = World(
            load_robot_config(self._options.text("robot_config") or None, folders),
            load_door(self._options.text("door"), folders),
            self._options.number("door_distance"),
            self._options.number("hinge_x"),
            **self._options.world_settings(),
        )
        self._imu_variances = imu_variances(self.world.settings.sensors)
        self._pacer = Pacer(self._options.speed())
        self._encoder = SampleBatcher(
            period_ns=round(SAMPLE * 1e9), size=ENCODER_BATCH, counts_per_turn=COUNTS_PER_TURN)
        self._accepted, self._refused = 0, 0
        self._refusal = ""
        self._fall_reported = False
        self._ticks = 0
        self._make_publishers()
        self.create_subscription(JointTrajectory, "/joint_trajectory", self._on_trajectory, QUEUE)
        self.create_service(Trigger, "/sim/reset", self._on_reset)
        self.create_service(PushDoor, "/sim/push_door", self._on_push)
        self.create_service(PushRobot, "/sim/push_robot", self._on_push_robot)
        self.create_service(Trigger, "~/stop", self._on_stop)
        self.create_service(Trigger, "~/save_log", self._on_save_log)

    def _make_publishers(self) -> None:
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._clock_topic = self.create_publisher(Clock, "/clock", QUEUE)
        self._joints = self.create_publisher(JointState, "/joint_states", QUEUE)
        self._imu = self.create_publisher(Imu, "/imu", QUEUE)
        self._wrenches = {
            side: self.create_publisher(WrenchStamped, f"/{side}_foot/wrench", QUEUE)
            for side in SIDES
        }
        self._hands = {
            side: self.create_publisher(WrenchStamped, f"/{side}_wrist/wrench", QUEUE)
            for side in self.world.robot_config.wrist_sensors or ()
        }
        self._counts = self.create_publisher(EncoderSamples, "/door_encoder/counts", QUEUE)
        self._description = self.create_publisher(String, "/robot_description", latched)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", QUEUE)
        urdf = self.world.robot_config.urdf_path.read_text(encoding="utf-8")
        self._description.publish(String(data=urdf))

    def run(self) -> None:
        """Step the world until the context ends; then write the log if `log_file` is set.

        Raises:
            SecondDriverError: The driver of a robot is in the graph already.
        """
        if self.count_publishers("/joint_states") > 1:
            raise SecondDriverError("/joint_states")
        try:
            with executor_of(self) as executor:
                while rclpy.ok():
                    self._publish(self.world.step())
                    self._pacer.advance(TICK)
                    spin_for(executor, self._pacer.wait())
        finally:
            self._finish()

    def _now_ns(self) -> int:
        return round(self.world.time / TICK) * TICK_NS

    def _publish(self, sample: TickSample) -> None:
        now = self._now_ns()
        stamp = stamp_of(now)
        if self._ticks % CLOCK_TICKS == 0:
            self._clock_topic.publish(Clock(clock=stamp))
        robot = self.world.robot_config
        self._joints.publish(convert.joint_state(stamp, robot.joint_names, sample))
        left, right = robot.feet["left"].sole, robot.feet["right"].sole
        self._wrenches["left"].publish(convert.wrench(stamp, left, sample.left_wrench))
        self._wrenches["right"].publish(convert.wrench(stamp, right, sample.right_wrench))
        for side, measured in zip(
                SIDES, (sample.left_hand_wrench, sample.right_hand_wrench), strict=True):
            if robot.wrist_sensors is not None and measured is not None:
                frame = robot.wrist_sensors[side].link
                self._hands[side].publish(convert.wrench(stamp, frame, measured))
        imu_frame = needed(robot.imu_frame, "imu_frame")
        self._imu.publish(convert.imu(stamp, imu_frame, sample.imu, self._imu_variances))
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
            "accepted": self._accepted,
            "refused": self._refused,
            "last_refusal": self._refusal,
            "max_tilt_deg": f"{np.degrees(world.fall.max_tilt):.2f}",
        }
        self._diagnostics.publish(
            convert.diagnostics(
                stamp_of(self._now_ns()), world.robot_config.name, level, text, values
            )
        )

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

    def _on_stop(self, _: Any, response: Any) -> Any:
        self.world.stop()
        response.success, response.message = True, "braking, then holding still"
        return response

    def _on_reset(self, _: Any, response: Any) -> Any:
        self.world.reset()
        self._encoder.restart()  # the door is shut, so that door_encoder can take its zero again
        self._refusal, self._fall_reported = "", False
        self._ticks = 0
        self._clock_topic.publish(Clock(clock=stamp_of(self._now_ns())))
        response.success, response.message = True, "back in half-sitting at time 0"
        return response

    def _on_push(self, request: Any, response: Any) -> Any:
        duration = self._push_duration if request.duration < 0.0 else request.duration
        try:
            self.world.push_door(request.impulse, duration)
        except SettingError as error:
            response.success, response.message = False, str(error)
        else:
            response.success = True
            response.message = f"{request.impulse:g} N m s over {duration:g} s"
            angle = self.world.door_state.angle
            if angle > _SHUT:
                response.message += (
                    f"; the door is open by {math.degrees(angle):.1f} deg, and a push for an "
                    "identification should begin with a shut door")
        return response

    def _on_push_robot(self, request: Any, response: Any) -> Any:
        impulse = np.array([request.impulse.x, request.impulse.y, request.impulse.z])
        try:
            self.world.push_robot(impulse, request.duration)
        except SettingError as error:
            response.success, response.message = False, str(error)
        else:
            response.success = True
            response.message = f"{np.linalg.norm(impulse):g} N s over {request.duration:g} s"
        return response

    def _on_save_log(self, _: Any, response: Any) -> Any:
        if not self._log_file:
            response.success, response.message = False, "the parameter log_file is empty"
            return response
        try:
            response.message = str(self.world.save_log(self._log_file))
            response.success = True
        except OutputError as error:
            response.success, response.message = False, str(error)
        return response

    def _finish(self) -> None:
        """Write the log if `log_file` is set, and release the simulator."""
        try:
            if self._log_file:
                self.world.save_log(self._log_file)
        except OutputError as error:
            print(f"{NAME}: {error}", file=sys.stderr)
        finally:
            self.world.close()


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; return the exit code."""
    return run_node(SimBridge, errors=(OSError,), args=args, spin=SimBridge.run)


if __name__ == "__main__":
    sys.exit(main())

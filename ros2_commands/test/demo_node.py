"""A node with a bit of everything; prints "ready" when it runs."""

import time
from contextlib import suppress
from typing import Any

import rclpy
from door_impact_msgs.action import Walk
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import SetBool


class Demo(Node):
    """Refuses walks of a negative step duration; one of 99 s lasts until it is cancelled."""

    def __init__(self) -> None:
        super().__init__("demo", namespace="arm")
        limits = FloatingPointRange(from_value=0.0, to_value=10.0)
        descriptor = ParameterDescriptor(description="of it", floating_point_range=[limits])
        self.declare_parameter("gain", 1.5, descriptor)
        self.declare_parameter("names", ["a", "b"])
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.kept = self.create_publisher(String, "kept", latched)
        self.kept.publish(String(data="grüß"))
        self.imu = self.create_publisher(Imu, "imu", qos_profile_sensor_data)
        self.create_timer(0.02, lambda: self.imu.publish(Imu()))
        self.create_subscription(Float64MultiArray, "say", lambda m: print(list(m.data)), 10)
        self.create_service(SetBool, "flip", self.flip)
        self.walks = ActionServer(
            self, Walk, "walk", self.walk, callback_group=ReentrantCallbackGroup(),
            goal_callback=lambda goal: GoalResponse(1 + (goal.step_duration > 0)),
            cancel_callback=lambda _: CancelResponse.ACCEPT)  # fmt: skip

    def flip(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = not request.data
        return response

    def walk(self, handle: Any) -> Walk.Result:
        while not handle.is_cancel_requested and rclpy.ok():
            handle.publish_feedback(Walk.Feedback(step=1))
            time.sleep(0.02)
            # A client may discover the feedback late; a goal without a listener goes on.
            if handle.request.step_duration < 99 and self.feedback_is_heard():
                handle.succeed()
                return Walk.Result(success=True)
        handle.canceled()
        return Walk.Result()

    def feedback_is_heard(self) -> bool:
        return self.count_subscribers("walk/_action/feedback") > 0


rclpy.init()
node = Demo()
print("ready", flush=True)
with suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(node, MultiThreadedExecutor(4))

"""A node with a bit of everything, for the tests to talk to."""

import rclpy
from action_msgs.srv import CancelGoal  # noqa: F401 - importing it must work
from door_impact_msgs.action import ExecuteDoorImpact
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.task import Future
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool


class Peer(Node):
    def __init__(self) -> None:
        super().__init__("peer")
        limits = ParameterDescriptor(
            floating_point_range=[FloatingPointRange(from_value=0.0, to_value=10.0)]
        )
        self.declare_parameter("gain", 1.5, limits)
        self.declare_parameter("names", ["a", "b"])
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_publisher(String, "latched", latched).publish(String(data="kept"))
        self.joints = self.create_publisher(JointState, "joints", 10)
        self.imu = self.create_publisher(Imu, "imu", qos_profile_sensor_data)
        self.create_timer(0.02, self.tick)
        self.echo = self.create_publisher(String, "heard", 10)
        self.create_subscription(String, "say", lambda m: self.echo.publish(m), 10)
        self.create_service(SetBool, "~/flip", self.flip)
        self.server = ActionServer(
            self,
            ExecuteDoorImpact,
            "push",
            self.execute,
            goal_callback=lambda g: GoalResponse(1 + (g.plan_id != "refuse")),
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        self.ready = False

    def tick(self) -> None:
        if not self.ready:  # now it spins
            self.ready = True
            self.get_logger().info("ready")
        self.joints.publish(JointState(name=["a", "b"], position=[1.0, 2.5]))
        self.imu.publish(Imu())

    def flip(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = not request.data
        return response

    def wait(self, seconds: float) -> Future:
        future = Future()

        def fire() -> None:
            self.destroy_timer(timer)
            future.set_result(None)

        timer = self.create_timer(seconds, fire)
        return future

    async def execute(self, handle):
        if handle.request.plan_id == "fail":
            raise RuntimeError("as asked")
        # Four steps are long enough for a client's subscription to be discovered meanwhile.
        steps, period = (4, 0.2) if handle.request.plan_id == "quick" else (500, 0.01)
        for step in range(steps):
            handle.publish_feedback(ExecuteDoorImpact.Feedback(phase=str(step)))
            await self.wait(period)
            if handle.is_cancel_requested:
                handle.canceled()
                return ExecuteDoorImpact.Result(message="cancelled")
        handle.succeed()
        return ExecuteDoorImpact.Result(success=True, peak_angle=0.4)


def main() -> None:
    """Runs the node."""
    rclpy.init()
    node = Peer()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()

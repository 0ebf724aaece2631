"""A subscription with the depth of its argument, which prints what it hears, and a service."""

import sys
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import String
from std_srvs.srv import SetBool


def flip(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
    """Answers with the opposite."""
    response.success = not request.data
    return response


def main() -> None:
    """Runs the node."""
    rclpy.init()
    name, depth = sys.argv[1], int(sys.argv[2])
    node = rclpy.create_node(name)
    node.create_subscription(String, "counted", lambda m: print(m.data, flush=True), depth)
    node.create_service(SetBool, f"{name}/flip", flip)
    print("ready", flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()

"""A machine's process that takes part in several domains, and tells whom it hears in each.

Its argument is JSON: its name, and for each domain a range and static peers. It ends when its
standard input does, and then prints whom it heard.
"""

import json
import os
import sys
import threading

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

PERIOD = 0.1  # [s]


def join(name: str, domain: int, reach: str, peers: str) -> set[str]:
    """Starts a node in a domain that says its name; the set fills with those that it hears."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = reach
    os.environ["ROS_STATIC_PEERS"] = peers
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = Node(f"node_{name}", context=context)
    heard: set[str] = set()
    publisher = node.create_publisher(String, "names", 10)
    node.create_subscription(String, "names", lambda m: heard.add(m.data), 10)
    node.create_timer(PERIOD, lambda: publisher.publish(String(data=name)))
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    return heard


def main() -> None:
    """Runs until the end of standard input."""
    asked = json.loads(sys.argv[1])
    heard = {domain: join(asked["name"], int(domain), *how) for domain, how in asked["in"].items()}
    print("ready", flush=True)
    sys.stdin.read()
    print(json.dumps({d: sorted(names - {asked["name"]}) for d, names in heard.items()}))
    sys.stdout.flush()
    os._exit(0)  # what is tried here is the start, not the end


if __name__ == "__main__":
    main()

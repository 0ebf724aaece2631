"""A machine's process that takes part in several domains, and tells whom it hears in each.

Its argument is JSON: its name, and for each domain a range and static peers. For each line of its
standard input it prints whom it has heard.
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
    """Runs until it is killed."""
    asked = json.loads(sys.argv[1])
    heard = {domain: join(asked["name"], int(domain), *how) for domain, how in asked["in"].items()}
    print("ready", flush=True)
    for _ in sys.stdin:
        found = {d: sorted(names - {asked["name"]}) for d, names in heard.items()}
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()

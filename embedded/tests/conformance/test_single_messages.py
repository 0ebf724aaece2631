"""Messages without a callback: in bytes, and one of a topic waited for."""

import threading
import time

import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.wait_for_message import wait_for_message
from sensor_msgs.msg import JointState
from spinning import make
from std_msgs.msg import String

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_bytes_of_a_message() -> None:
    """CDR with its header, little endian; they are read back."""
    data = serialize_message(String(data="abc"))
    assert data[:12] == b"\0\1\0\0\4\0\0\0abc\0"
    joints = JointState(name=["a", "b"], position=[1.0, -2.0])
    joints.header.frame_id = "base"
    assert deserialize_message(serialize_message(joints), JointState) == joints
    with pytest.raises(AttributeError):
        serialize_message("text")


@pytest.mark.parametrize("spun", [False, True])
def test_wait_for_a_message(executor: SingleThreadedExecutor, spun: bool) -> None:
    """It comes from another thread; the node is not spun meanwhile, but may have been."""
    node = make(executor)
    if spun:
        executor.spin_once(timeout_sec=0.0)
    executor.remove_node(node)
    publisher = node.create_publisher(PoseStamped, "pose", 1)
    message = PoseStamped()
    message.pose.position.x = 1.5
    over = threading.Event()

    def publish() -> None:
        while not over.wait(0.01):
            publisher.publish(message)

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        assert wait_for_message(PoseStamped, node, "pose", time_to_wait=20) == (True, message)
    finally:
        over.set()
        thread.join()
    assert publisher.get_subscription_count() == 0


def test_wait_for_a_message_that_is_there(executor: SingleThreadedExecutor) -> None:
    """A latched one; without an end to the wait."""
    node = make(executor)
    node.create_publisher(String, "word", LATCHED).publish(String(data="x"))
    executor.remove_node(node)
    came, message = wait_for_message(String, node, "word", qos_profile=LATCHED)
    assert (came, message) == (True, String(data="x"))


def test_wait_for_a_message_ends(executor: SingleThreadedExecutor) -> None:
    """When the time is over."""
    node = make(executor)
    executor.remove_node(node)
    began = time.monotonic()
    assert wait_for_message(String, node, "none", time_to_wait=0.2) == (False, None)
    assert time.monotonic() - began >= 0.2

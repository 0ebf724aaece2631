"""What the running graph shows to who looks at it: nodes, rates, the standing robot."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio
import pytest
import yaml
from door_impact_common.constants import GRAVITY
from geometry_msgs.msg import PointStamped, WrenchStamped
from hrp2_description.robot import load_robot_config
from processes import GUARD
from running_graph import seconds
from sensor_msgs.msg import JointState

NODES = ["/closer_identifier", "/door_encoder", "/hrp2_sim_bridge",
         "/impact_planner", "/motion_server", "/scene_publisher", "/zmp_publisher"]


@pytest.mark.usefixtures("graph")
def test_node_list_shows_every_node(ros2: Callable[..., Any]) -> None:
    """Once they are discovered."""
    end, shown = time.monotonic() + GUARD, list[str]()
    while [name for name in shown if name != "/tests_of_the_graph"] != NODES:
        assert time.monotonic() < end, shown
        shown = ros2("node", "list").out.split()


@pytest.mark.usefixtures("graph")
def test_topic_echo_prints_the_zmp(ros2: Callable[..., Any]) -> None:
    """ROS 2's form of a PointStamped in odom, between the feet on the floor.

    ROS 2 on a loaded machine may print before it that an earlier message was lost.
    """
    done = ros2("topic", "echo", "--once", "/zmp")
    assert done.status == 0, done.err
    *_, text, rest = done.out.split("---\n")
    assert rest == ""
    message = yaml.safe_load(text)
    assert list(message) == ["header", "point"]
    assert message["header"]["frame_id"] == "odom"
    assert list(message["point"]) == ["x", "y", "z"]
    assert -0.10 < message["point"]["x"] < 0.13  # heel and toe
    assert -0.04 < message["point"]["y"] < 0.04  # the inner edges
    assert message["point"]["z"] == 0.0


def test_the_zmp_comes_at_200_hz_of_simulated_time(graph: Any) -> None:
    """Stamps lie 5 ms apart; what a busy machine loses is lost whole."""
    heard = graph.listen(PointStamped, "/zmp", lambda got: len(got) > 400)
    ticks = np.diff([seconds(m.header.stamp) for m in heard]) / 0.005
    assert ticks == pytest.approx(np.round(ticks), abs=1e-3)
    assert (np.round(ticks) >= 1).all()
    assert np.median(ticks) == pytest.approx(1.0, abs=1e-3)


def test_the_soles_carry_the_weight(graph: Any) -> None:
    """m g to 0.5 %, either foot its share, both heard together: the robot sways a little."""
    left: dict[float, float] = {}
    heard = graph.node.create_subscription(
        WrenchStamped, "/left_foot/wrench",
        lambda m: left.update({seconds(m.header.stamp): m.wrench.force.z}), 100)
    right = graph.listen(WrenchStamped, "/right_foot/wrench", lambda got: sum(
        seconds(m.header.stamp) in left for m in got) > 200)
    graph.node.destroy_subscription(heard)
    assert {m.header.frame_id for m in right} == {"r_sole"}
    both = [(left[time], m.wrench.force.z) for m in right
            if (time := seconds(m.header.stamp)) in left]
    force = np.mean(both, axis=0)
    assert force.sum() == pytest.approx(58.0 * GRAVITY, rel=0.005)
    assert force[0] == pytest.approx(force[1], rel=0.1)


def test_the_zmp_of_a_standing_robot_is_below_its_center_of_mass(graph: Any) -> None:
    """By Pinocchio on the URDF, from /joint_states, midway between the soles: within 3 mm."""
    urdf = str(load_robot_config().urdf_path)
    model = pinocchio.buildModelFromUrdf(urdf, pinocchio.JointModelFreeFlyer())
    data, q = model.createData(), pinocchio.neutral(model)
    state = graph.last(JointState, "/joint_states")
    for name, angle in zip(state.name, state.position, strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pinocchio.framesForwardKinematics(model, data, q)
    soles = [data.oMf[model.getFrameId(name)].translation for name in ("l_sole", "r_sole")]
    com = pinocchio.centerOfMass(model, data, q) - np.mean(soles, axis=0)
    heard = graph.listen(PointStamped, "/zmp", lambda got: len(got) > 100)
    zmp = np.mean([(m.point.x, m.point.y) for m in heard], axis=0)
    assert zmp == pytest.approx(com[:2], abs=0.003)

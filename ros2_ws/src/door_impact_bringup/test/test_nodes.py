"""The nodes scene_publisher and recorder, run in the process of the test."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from ament_index_python.packages import get_package_share_directory
from door_impact_bringup import recorder_node, scene_publisher_node
from door_impact_bringup.graph import parameters_for
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.settings import BRACES, ENGINES, SOLES, WorldSettings
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.placement import bringup_parameters, configured_placement
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


@pytest.fixture(params=["", "robot1"])
def pair(request: pytest.FixtureRequest) -> Iterator[tuple[Any, Node, SingleThreadedExecutor]]:
    """Returns scene_publisher, another node, and the executor that spins both."""
    moved = ["-r", f"__ns:=/{request.param}", "-p", f"frame_prefix:={request.param}/"]
    rclpy.init(args=["--ros-args", "-p", "door_distance:=0.738", "-p", "hinge_x:=-0.4056",
                     *(moved if request.param else ())])
    nodes = scene_publisher_node.ScenePublisher(), Node("viewer")
    executor = SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    yield *nodes, executor
    for node in nodes:
        node.destroy_node()
    executor.shutdown()
    rclpy.shutdown()


def first_message(executor: Any, received: list[Any]) -> Any:
    """Spins until there is a message, and returns it."""
    for _ in range(2000):
        if received:
            return received[0]
        executor.spin_once(timeout_sec=0.01)
    raise AssertionError("no message was received")


def test_a_late_viewer_gets_description_and_place_of_the_door(
        pair: tuple[Any, Node, SingleThreadedExecutor]) -> None:
    """Both topics are latched; the hinge is at (hinge_x, -door_distance) in odom."""
    _, viewer, executor = pair
    prefix = f"{viewer.get_namespace()}/".lstrip("/")
    descriptions: list[String] = []
    places: list[TFMessage] = []
    viewer.create_subscription(String, "door_description", descriptions.append, LATCHED)
    viewer.create_subscription(TFMessage, "/tf_static", places.append, LATCHED)
    description = first_message(executor, descriptions).data
    assert '<joint name="door_hinge"' in description
    assert 'name="wall_free_side"' in description
    (standing,) = first_message(executor, places).transforms
    assert (standing.header.frame_id, standing.child_frame_id) == (
        f"{prefix}odom", f"{prefix}door_frame")
    place = standing.transform.translation
    assert (place.x, place.y, place.z) == (-0.4056, -0.738, 0.0)


def test_the_leaf_turns_with_the_doors_angle(
        pair: tuple[Any, Node, SingleThreadedExecutor]) -> None:
    """An opening angle of 30 deg turns the leaf by -30 deg about z, at the angle's stamp."""
    _, viewer, executor = pair
    prefix = f"{viewer.get_namespace()}/".lstrip("/")
    moves: list[TFMessage] = []
    viewer.create_subscription(TFMessage, "/tf", moves.append, 10)
    publisher = viewer.create_publisher(JointState, "door_angle", LATCHED)
    angle = JointState(name=["door_hinge"], position=[math.radians(30.0)])
    angle.header.stamp.sec = 7
    while not moves:
        publisher.publish(angle)
        executor.spin_once(timeout_sec=0.01)
    (leaf,) = moves[0].transforms
    assert (leaf.header.frame_id, leaf.child_frame_id) == (
        f"{prefix}door_frame", f"{prefix}door_leaf")
    assert leaf.header.stamp.sec == 7
    turn = leaf.transform.rotation
    assert 2.0 * math.atan2(turn.z, turn.w) == pytest.approx(math.radians(-30.0))


def test_a_recorder_that_cannot_write_ends(
        tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """For an existing file one line names it; the status is 1."""
    path = tmp_path / "old.mcap"
    path.write_text("old")
    assert recorder_node.main(["--ros-args", "-p", f"file:={path}"]) == 1
    error = capfd.readouterr().err
    assert f"recorder: {path}: " in error
    assert "Traceback" not in error
    assert (tmp_path / "old.mcap").read_text() == "old"


@pytest.mark.parametrize(("offers", "reliable", "latched"), [
    ((LATCHED,), True, True), ((LATCHED, QoSProfile(depth=10)), True, False),
    ((BEST_EFFORT, QoSProfile(depth=10)), False, False)])
def test_the_recorder_asks_for_what_every_publisher_offers(
        offers: tuple[QoSProfile, ...], reliable: bool, latched: bool) -> None:
    """The request is the strongest that each offer meets, with room for 5 s at 200 Hz."""
    request = recorder_node.request_for(offers)
    assert (request.reliability == ReliabilityPolicy.RELIABLE) is reliable
    assert (request.durability == DurabilityPolicy.TRANSIENT_LOCAL) is latched
    assert request.depth >= 1000


def launched(kind: str, file: str = "bringup.launch.yaml") -> list[dict[str, Any]]:
    """Returns the arguments ("arg"), nodes ("node") or included files of a launch file."""
    path = Path(get_package_share_directory("door_impact_bringup"), "launch", file)
    return [entity[kind] for entity in yaml.safe_load(path.read_text())["launch"]
            if kind in entity and entity[kind].get("pkg") != "rviz2"]


def test_both_launch_files_pass_the_simulations_choices_on() -> None:
    """Their choices and defaults are the bridge's; demo passes to bringup, and it to the bridge."""
    (bridge,) = (node for node in launched("node") if node["name"] == "hrp2_sim_bridge")
    (included,) = launched("include", "demo.launch.yaml")
    for name, allowed in (("engine", ENGINES), ("brace", BRACES), ("sole", SOLES)):
        for file in ("bringup.launch.yaml", "demo.launch.yaml"):
            (argument,) = (each for each in launched("arg", file) if each["name"] == name)
            assert {choice["value"] for choice in argument["choice"]} == {*allowed}
            assert argument["default"] == getattr(WorldSettings, name)
        passed = {"name": name, "value": f"$(var {name})"}
        assert passed in bridge["param"]
        assert passed in included["arg"]


def test_parameters_and_frames_follow_the_namespace() -> None:
    """Each key of params.yaml holds in any namespace; with one, its name precedes each frame."""
    folder = Path(get_package_share_directory("door_impact_bringup"), "config")
    keys = set(yaml.safe_load((folder / "params.yaml").read_text()))
    assert keys <= {"/**", *(f"/**/{node['name']}" for node in launched("node"))}
    (prefix,) = (arg["default"] for arg in launched("arg") if arg["name"] == "frame_prefix")
    for given, expected in {"": "", "robot1": "robot1/", "/a/b": "a/b/"}.items():
        expression = prefix.removeprefix('$(eval "').removesuffix('")')
        assert eval(expression.replace("$(var namespace)", given)) == expected


def test_another_robot_gets_the_parameters_with_its_own_place_of_the_door(tmp_path: Path) -> None:
    """Only where no file is given; the robot of params.yaml keeps the place in that."""
    own = RobotModel(load_robot_config())
    assert parameters_for(own, "") == ""
    other = RobotModel(replace(own.config, file=Path("other.yaml"), step=replace(
        own.config.step, nominal=0.2)))
    made = yaml.safe_load(Path(parameters_for(other, "")).read_text())
    assert made["/**"]["ros__parameters"].items() >= vars(configured_placement(other)).items()
    assert made.keys() == bringup_parameters().keys()
    assert configured_placement(own).door_distance != configured_placement(other).door_distance
    (tmp_path / "given.yaml").touch()
    assert parameters_for(other, str(tmp_path / "given.yaml")) == str(tmp_path / "given.yaml")


def test_every_node_is_required_but_recorder_and_view() -> None:
    """If a node ends, all end; without the recorder, as on a full disk, the others go on.

    A spawner of controllers ends when it has done its work.
    """
    nodes = launched("node")
    ends = {node["name"]: node.get("on_exit") for node in nodes}
    assert len(ends) == 12
    assert {name for name, action in ends.items() if action != "shutdown"} == {
        "recorder", "door_impact_view", "spawner", "sensor_spawner"}

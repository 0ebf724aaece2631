"""A second set of the nodes in the domain of the first."""

from pathlib import Path

import pytest
from geometry_msgs.msg import PointStamped
from processes import Started, find_ros2
from running_graph import Graph


@pytest.mark.nightly("starts every node; test_node.py refuses a twin")
def test_a_second_graph_is_refused(graph: Graph, tmp_path: Path) -> None:
    """The first node that is refused ends the others, which may still be loading their modules."""
    second = Started([find_ros2(), "launch", "door_impact_bringup", "bringup.launch.yaml",
                      "paced:=false"], tmp_path / "second.txt")
    try:
        second.wait()
        text = second.text()
        assert second.left_over() == []
    finally:
        second.clean_up()
    assert "is in the graph: end that node first" in text
    assert graph.last(PointStamped, "/zmp") is not None

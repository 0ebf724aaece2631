"""One running graph for all tests of this folder.

The fixture of a package ends with the package only if it is defined in the package itself.
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import pytest
from geometry_msgs.msg import PointStamped
from processes import stop_daemon
from running_graph import Graph, launch
from std_srvs.srv import Trigger


@dataclass(frozen=True)
class Nodes:
    """A running graph and its ROS_DOMAIN_ID."""

    graph: Graph
    domain: int


@contextmanager
def in_domain(domain: int) -> Iterator[None]:
    """Contexts and processes that begin meanwhile are in another domain."""
    before = os.environ["ROS_DOMAIN_ID"]
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    try:
        yield
    finally:
        os.environ["ROS_DOMAIN_ID"] = before


@pytest.fixture(scope="package")
def nodes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nodes]:
    """Every node, as `make up` starts them but as fast as it goes; one set for this folder.

    It has a domain of its own, because other tests start nodes of the same names.
    """
    own = int(os.environ["GRAPH_DOMAIN_ID"])
    with ExitStack() as end:
        with in_domain(own):
            running = end.enter_context(launch(tmp_path_factory.mktemp("graph"), "paced:=false"))
        yield Nodes(running, own)
        with in_domain(own):
            stop_daemon()


@pytest.fixture(scope="module")
def graph(nodes: Nodes) -> Iterator[Graph]:
    """The nodes after a reset, so that a module finds robot and door as at the start."""
    with in_domain(nodes.domain):
        answer = nodes.graph.call(Trigger, "/sim/reset")
        assert answer.success, answer.message
        nodes.graph.last(PointStamped, "/zmp")
        yield nodes.graph

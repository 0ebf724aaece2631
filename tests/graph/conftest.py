"""One running graph for all tests of this folder.

The fixture of a package ends with the package only if it is defined in the package itself.
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest
from processes import stop_daemon
from running_graph import Graph, launch


@contextmanager
def own_domain() -> Iterator[None]:
    """Contexts and processes that begin meanwhile are in the graph's own domain.

    Other tests start nodes of the same names.
    """
    before = os.environ["ROS_DOMAIN_ID"]
    os.environ["ROS_DOMAIN_ID"] = os.environ["GRAPH_DOMAIN_ID"]
    try:
        yield
    finally:
        os.environ["ROS_DOMAIN_ID"] = before


@pytest.fixture(scope="package")
def nodes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Graph]:
    """Every node, as `make up` starts them; one set for this folder.

    Not as fast as it goes: with the clock, the delays of a busy machine would grow.
    """
    with ExitStack() as end:
        with own_domain():
            folder = tmp_path_factory.mktemp("graph")
            running = end.enter_context(launch(
                folder, "engine:=mujoco", f"log_file:={folder / 'simulation.npz'}"))
        yield running
        with own_domain():
            stop_daemon()


@pytest.fixture(scope="module")
def graph(nodes: Graph) -> Iterator[Graph]:
    """The nodes after a reset, so that a module finds robot and door as at the start."""
    with own_domain():
        nodes.reset()
        yield nodes

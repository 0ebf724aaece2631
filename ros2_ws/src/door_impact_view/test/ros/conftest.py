"""The view beside a node that plays the rest of the graph."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import Any

import pytest
import rclpy
from door_impact_view.live.page_client import PageClient
from door_impact_view.ros.door_impact_view_node import DoorImpactView
from rclpy.executors import SingleThreadedExecutor


@pytest.fixture(scope="session")
def view_domain() -> int:
    """The ROS_DOMAIN_ID of the rigs, and of views in processes of their own beside them."""
    return int(os.environ["VIEW_DOMAIN_ID"])


class Rig:
    """The view, a node that plays the rest of the graph, and a client of the page."""

    def __init__(self) -> None:
        self.view = DoorImpactView()
        self.other = rclpy.create_node("other")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.other)
        self.pages: list[PageClient] = []

    def open_page(self) -> PageClient:
        """A further browser."""
        page = PageClient(int(self.view.url.rpartition(":")[2]))
        self.pages.append(page)
        return page

    def until(self, done: Callable[[], Any], each: Callable[[], Any] = lambda: None) -> None:
        """Run everything until a condition holds."""
        limit = time.monotonic() + 60.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            each()
            for _ in range(5):
                self.executor.spin_once(timeout_sec=0.0)
            self.view.tick()
            for page in self.pages:
                page.read(timeout=0.005)

    def end(self) -> None:
        """End everything."""
        for page in self.pages:
            page.close()
        self.view.destroy_node()
        self.executor.shutdown()
        self.other.destroy_node()


@contextmanager
def run_rig(domain: int, **parameters: Any) -> Iterator[Rig]:
    """A rig on a domain of its own; the view has these parameters."""
    words = [word for name, value in {"view_port": 0, **parameters}.items()
             for word in ("-p", f"{name}:={value}")]
    rclpy.init(args=["--ros-args", *words], domain_id=domain)
    made = None
    try:
        made = Rig()
        yield made
    finally:
        if made is not None:
            made.end()
        rclpy.shutdown()


@pytest.fixture
def rig(view_domain: int) -> Callable[..., AbstractContextManager[Rig]]:
    """Makes a rig whose view has the parameters that are given."""
    return partial(run_rig, view_domain)

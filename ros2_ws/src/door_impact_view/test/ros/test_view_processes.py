"""Views in processes of their own: taken ports, a view that is killed, missing libraries."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_view.live.page_client import PageClient
from rclpy.action import ActionServer, CancelResponse
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future


def test_two_views_take_two_ports(rig: Any, view_domain: int) -> None:
    """The second one says which port is taken."""
    with rig() as first:
        port = int(first.view.url.rpartition(":")[2])
        taken = subprocess.run(
            [sys.executable, "-m", "door_impact_view.ros.door_impact_view_node", "--ros-args",
             "-p", f"view_port:={port}"], capture_output=True, text=True, timeout=300,
            env={**os.environ, "ROS_DOMAIN_ID": str(view_domain)}, check=False)
    assert f"port {port} is taken" in taken.stderr
    assert "another node named /door_impact_view is in the graph" in taken.stderr
    assert taken.returncode == 1


@contextmanager
def view_process(domain: int, *arguments: str) -> Iterator["subprocess.Popen[str]"]:
    """A view in a process of its own, which is killed in the end."""
    with subprocess.Popen(
            [sys.executable, "-m", "door_impact_view.ros.door_impact_view_node", "--ros-args",
             *arguments], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)}) as view:
        try:
            yield view
        finally:
            view.kill()


def port_of(view: "subprocess.Popen[str]") -> tuple[int, str]:
    """The port on which a view says that it shows, and what it has said up to then."""
    said = ""
    for line in view.stderr or ():
        said += line
        if (found := re.search(r"shown at http://localhost:(\d+)", line)) is not None:
            return int(found[1]), said
    raise AssertionError(said)


def test_a_view_that_is_killed_stops_no_motion(view_domain: int) -> None:
    """The goal that its button sent goes on to its end, and nobody asks to cancel it."""
    context = Context()
    rclpy.init(context=context, domain_id=view_domain)
    node = rclpy.create_node("executor", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    events: list[str] = []

    async def execute(goal: Any) -> Any:
        events.append("begun")
        await killed
        for _ in range(20):
            goal.publish_feedback(ExecuteDoorImpact.Feedback(phase="cam", progress=0.5))
        goal.succeed()
        events.append("ended")
        return ExecuteDoorImpact.Result(success=True)

    def cancel(_goal: Any) -> Any:
        events.append("cancelled")
        return CancelResponse.ACCEPT

    killed = Future(executor=executor)
    server = ActionServer(node, ExecuteDoorImpact, "/execute_door_impact", execute,
                          cancel_callback=cancel)

    def until(done: Callable[[], Any], read: Callable[[], Any] = lambda: None) -> None:
        limit = time.monotonic() + 120.0
        while not done():
            assert time.monotonic() < limit, events
            executor.spin_once(timeout_sec=0.02)
            read()

    try:
        arguments = ("-p", "view_port:=0", "-r", "__node:=killed_view")  # no twin of those above
        with view_process(view_domain, *arguments) as view:
            page = PageClient(port_of(view)[0])
            until(lambda: page.has("Run"), page.read)
            while "begun" not in events:  # the view may not have found the server yet
                answers = len(page.notifications)
                page.press("Run")
                until(lambda answers=answers: events or len(page.notifications) > answers,
                      page.read)
        for _ in range(20):
            executor.spin_once(timeout_sec=0.01)
        killed.set_result(True)
        until(lambda: "ended" in events)
    finally:
        server.destroy()
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
    assert events == ["begun", "ended"]

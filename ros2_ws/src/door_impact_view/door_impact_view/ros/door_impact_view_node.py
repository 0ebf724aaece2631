"""Node ``door_impact_view``: a page in the browser that shows robot and door and has buttons."""

from __future__ import annotations

import sys
import time
from typing import Any

import rclpy
from door_impact_common.node import GuardedNode, executor_of, run_node, spin_for
from door_impact_common.parameters import FRAME_PREFIX, Parameters

from door_impact_view.errors import ViewerMissingError
from door_impact_view.ros.operator import Operator
from door_impact_view.ros.watcher import Watcher

LOCAL = "127.0.0.1"
PARAMETERS: dict[str, tuple[Any, str]] = {
    "view_host": (
        LOCAL, "name or IPv4 address of this machine at which the page is served; 0.0.0.0: at "
        "every one: everybody who reaches the page then moves the robot with its buttons"),
    "view_port": (8080, "port of the page; if it is taken, the next free one; 0: any free one"),
    "view_rate": (10.0, "rate at which the page is drawn while a browser shows it [Hz]"),
    "world_frame": ("odom", "frame in which everything is drawn"),
    "frame_prefix": FRAME_PREFIX,
}
_PLOT_RATE = 4.0  # rate at which plots and texts are sent [Hz]
_WARNED = 10.0  # shortest time between two warnings about messages [s]


class DoorImpactView(GuardedNode):
    """Shows what the other nodes publish, and passes the buttons' orders on to them.

    Attributes:
        page: The page.
        period: Time between two drawings [s].
        tick: Passes orders on, and draws what has come if a browser is there.

    Raises:
        SettingError: A parameter is out of its range.
        AddressError: The page cannot be served at this address.
        ViewerMissingError: viser is not installed.
    """

    def __init__(self) -> None:
        super().__init__("door_impact_view")
        try:  # not before: without viser the node ends with a sentence
            from door_impact_view.live.page import Page
        except ImportError as missing:
            raise ViewerMissingError(missing.name or "viser") from missing

        parameters = Parameters(self, PARAMETERS)
        rate = parameters.positive("view_rate")
        port = int(parameters.number("view_port", 0, 65535))
        host = parameters.text("view_host")
        local = host in (LOCAL, "localhost")
        self._operator = Operator(self)
        self._watcher = Watcher(self, parameters.text("world_frame"),
                                parameters.text("frame_prefix"), self._warn)
        self.page = Page(LOCAL if local else host, port, self._operator.give,
                         max(1, round(rate / _PLOT_RATE)))
        self._problem = ""
        self.period = 1.0 / rate
        self.tick = self.guarded(self._tick, "drawing the page")
        if port not in (0, self.page.port):
            self.get_logger().warning(f"port {port} is taken by another program")
        name = "localhost" if local else host
        self.get_logger().info(f"robot and door are shown at http://{name}:{self.page.port}")

    def destroy_node(self) -> None:
        """End the page and the node."""
        self.page.stop()
        super().destroy_node()

    def _tick(self) -> None:
        self._operator.work()
        self._watcher.watch(self.page.watched)
        if not self.page.watched:
            return
        state = self._watcher.update()
        state.served = self._operator.served()
        self.page.draw(state)
        if state.problem != self._problem:
            self._problem = state.problem
            if self._problem:
                self.get_logger().warning(self._problem)

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=_WARNED)


def run(node: DoorImpactView) -> None:
    """Take the last messages and draw them, at the node's period, until the context ends.

    In between the middleware drops what is not the last: that costs far less than a callback for
    each of some thousand messages in a second.

    Raises:
        ExternalShutdownException: The context has ended.
    """
    with executor_of(node) as executor:
        while rclpy.ok():
            spin_for(executor, 0.0)
            node.tick()
            time.sleep(node.period)


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; return the exit code."""
    return run_node(DoorImpactView, args=args, spin=run)


if __name__ == "__main__":
    sys.exit(main())

"""Node ``door_impact_view``: a page in the browser that shows robot and door and has buttons."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

import rclpy
from door_impact_common.errors import SettingError
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import Parameters

from door_impact_view.ros.operator import Operator
from door_impact_view.ros.paced_executor import PacedExecutor
from door_impact_view.ros.watcher import Watcher

if TYPE_CHECKING:
    from door_impact_view.live.page import Page

PARAMETERS: dict[str, tuple[Any, str]] = {
    "view_host": (
        "localhost", "name or address of this machine at which the page is served; 0.0.0.0: at "
        "every one, for other machines too, without buttons unless there is a view_token"),
    "view_port": (8080, "port of the page; if it is taken, the next free one"),
    "view_rate": (20.0, "rate at which the page is drawn while a browser shows it [Hz]"),
    "view_token": ("", "what a browser has to enter before it gets buttons; empty: nothing, "
                       "but then a page for other machines has no buttons"),
    "world_frame": ("odom", "frame in which everything is drawn"),
}
_PLOT_RATE = 4.0  # rate at which plots and texts are sent [Hz]
_WARNED = 10.0  # shortest time between two warnings about messages [s]


class DoorImpactView(GuardedNode):
    """Shows what the other nodes publish, and passes the buttons' orders on to them.

    `tick` does all the work: it takes the messages that have come, passes orders on and draws. It
    is called at the parameter `view_rate` by `run`, which skips ticks that are late.

    Raises:
        SettingError: A parameter is out of its range.
        AddressError: The page cannot be served at this address.
        ViewerMissingError: viser is not installed.
    """

    def __init__(self) -> None:
        super().__init__("door_impact_view")
        # Not before: without viser the node ends with a sentence.
        from door_impact_view.live.page import Page
        from door_impact_view.live.server import listen

        parameters = Parameters(self, PARAMETERS)
        rate = parameters.positive("view_rate")
        self.period = 1.0 / rate
        token = parameters.value("view_token")
        if not isinstance(token, str):  # 0123 would be another number
            raise SettingError("view_token", token, "a text with a letter in it")
        wanted = parameters.whole("view_port")
        listening = listen(parameters.text("view_host"), wanted)
        self._operator = Operator(self)
        self._watcher = Watcher(self, parameters.text("world_frame"), self._warn)
        self.page: Page = Page(
            listening, token, self._operator.give, max(1, round(rate / _PLOT_RATE)))
        self.executor_of_ticks = PacedExecutor()
        self.executor_of_ticks.add_node(self)
        self._problem = ""
        self._draw = self.guarded(self.page.draw, "drawing the page")
        self._work = self.guarded(self._operator.work, "an order of the page")
        self.url = listening.url
        if listening.taken:
            ports = " and ".join(str(port) for port in listening.taken)
            self.get_logger().warning(f"port {ports} is taken by another program")
        if listening.local or token:
            how = "" if not token else "; its buttons need the view_token"
        else:
            how = "; it only shows, because there is no view_token"
        self.get_logger().info(f"robot and door are shown at {self.url}{how}")

    def tick(self) -> None:
        """Take what has come, pass orders on, and draw if a browser is there.

        Raises:
            ExternalShutdownException: The context was shut down.
        """
        self.executor_of_ticks.drain()
        self._work()
        watched = self.page.watched
        if watched and not self._watcher.watching:
            self._watcher.start()
        elif not watched and self._watcher.watching:
            self._watcher.stop()
        if not watched:
            return
        state = self._watcher.update()
        state.phase = self._operator.phase
        self._draw(state)
        if self.page.problem != self._problem:
            self._problem = self.page.problem
            if self._problem:
                self.get_logger().warning(self._problem)

    def destroy_node(self) -> None:
        """End the page and the node."""
        self.page.stop()
        self.executor_of_ticks.shutdown()
        super().destroy_node()

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=_WARNED)


def run(node: DoorImpactView) -> None:
    """Call a node's `tick` at its period until the context is shut down; skip calls that are late.

    Raises:
        ExternalShutdownException: The context was shut down.
    """
    due = time.monotonic()
    while rclpy.ok():
        node.tick()
        now = time.monotonic()
        due += node.period * max(1, -((due - now) // node.period))
        time.sleep(max(0.0, due - now))


def main(args: list[str] | None = None) -> int:
    """Run the node until Ctrl-C or SIGTERM; return the exit code."""
    return run_node(DoorImpactView, args=args, spin=run)


if __name__ == "__main__":
    sys.exit(main())

"""All orders that the world accepted, so that a run can be repeated bit for bit."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from humanoid_motion.driver_interface import TrajectoryArrays

_MOST = 5_000_000  # largest number of values that are kept, about 200 MB


class CommandLog:
    """Orders in the sequence in which the world accepted them.

    Args:
        kept: Whether orders are kept.
    """

    def __init__(self, *, kept: bool = True) -> None:
        self._kept = kept
        self.clear()

    def clear(self) -> None:
        """Delete all orders."""
        self._orders: list[dict[str, Any]] = []
        self._lost, self._numbers = 0, 0

    def add(self, tick: int, kind: str, *, numbers: int = 1, **content: Any) -> None:
        """Add an order.

        Args:
            tick: Number of the tick before which the order was accepted.
            kind: Kind of the order: trajectory, stop, push (of the door) or push_robot.
            numbers: Number of values in the content; beyond a limit all further orders are lost.
            content: Content of the order.
        """
        if not self._kept:
            return
        self._numbers += numbers
        if self._lost or self._numbers > _MOST:
            self._lost += 1
            return
        self._orders.append({"tick": tick, "kind": kind} | content)

    def text(self) -> str:
        """Return the log as JSON, which preserves every bit of a number."""
        return json.dumps({"lost": self._lost, "orders": self._orders})


def trajectory_content(message: TrajectoryArrays) -> dict[str, Any]:
    """Return the content of a trajectory in the types that JSON has."""
    return {name: _plain(value) for name, value in asdict(message).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, str | float | int):
        return value
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_plain(item) for item in value]

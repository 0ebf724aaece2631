"""Everything the world was told, so that a run can be had again, bit for bit."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from hrp2_sim_bridge.control.trajectory import TrajectoryArrays

_MOST = 5_000_000  # numbers kept, some 200 MB


class CommandLog:
    """Orders in the sequence in which the world took them."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._orders: list[dict[str, Any]] = []
        self._lost, self._numbers = 0, 0

    def add(self, tick: int, kind: str, *, numbers: int = 1, **content: Any) -> None:
        """Add an order of so many numbers that came before a tick."""
        self._numbers += numbers
        if self._lost or self._numbers > _MOST:
            self._lost += 1
            return
        self._orders.append({"tick": tick, "kind": kind} | content)

    def text(self) -> str:
        """The log as JSON, which keeps every bit of a number."""
        return json.dumps({"lost": self._lost, "orders": self._orders})


def trajectory_content(message: TrajectoryArrays) -> dict[str, Any]:
    """A trajectory as JSON takes it."""
    return {name: _plain(value) for name, value in asdict(message).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, str | float | int):
        return value
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_plain(item) for item in value]

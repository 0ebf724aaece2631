"""Everything the world was told, so that a run can be had again, bit for bit."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from hrp2_sim_bridge.errors import SettingError
from hrp2_sim_bridge.trajectory import TrajectoryArrays

if TYPE_CHECKING:
    from hrp2_sim_bridge.world import World

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


def replay(world: World, text: str, ticks: int) -> None:
    """Give a world that has just been made or reset the same orders at the same ticks.

    Args:
        world: of the same robot, door and settings.
        text: of a `CommandLog`.
        ticks: how far to step.

    Raises:
        SettingError: the log has lost orders, or the world is not at its start.
    """
    log = json.loads(str(text))  # as an npz gives it back, too
    if log["lost"]:
        raise SettingError("orders lost from the command log", log["lost"], 0)
    if world.tick != 0:
        raise SettingError("tick of the world", world.tick, 0)
    orders = log["orders"]
    for tick in range(ticks):
        while orders and orders[0]["tick"] == tick:
            _give(world, orders.pop(0))
        world.step()


def _give(world: World, order: dict[str, Any]) -> None:
    kind = order["kind"]
    if kind == "trajectory":
        world.follow(TrajectoryArrays(**order["trajectory"]), order["stamp"])
    elif kind == "stop":
        world.stop()
    else:
        world.push_door(order["impulse"], order["duration"])

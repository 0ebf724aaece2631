"""The command ``ros2 run hrp2_sim_bridge replay``: repeats a run from its log, without nodes."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError, SettingError
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.driver_interface import TrajectoryArrays

from hrp2_sim_bridge.settings import SensorSettings, WorldSettings
from hrp2_sim_bridge.world import World

_DESCRIPTION = "Repeat a run from its log and report whether both runs are the same."


def replay(world: World, text: str, ticks: int) -> None:
    """Give the orders of a log to a world at the same ticks.

    Args:
        world: World with the same robot, door and settings, just made or reset.
        text: Text of a `CommandLog`.
        ticks: Number of ticks to step.

    Raises:
        SettingError: The log has lost orders, or the world is not at its start.
    """
    log = json.loads(str(text))  # an npz file returns the text as an array
    if log["lost"]:
        raise SettingError("number of orders lost from the command log", log["lost"], 0)
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
    elif kind == "push":
        world.push_door(order["impulse"], order["duration"])
    elif kind == "push_robot":
        world.push_robot(np.array(order["impulse"]), order["duration"])
    else:
        raise SettingError(
            "kind of an order in the log", kind, "trajectory, stop, push or push_robot")


def replay_log(log: dict[str, Any]) -> dict[str, Any]:
    """Repeat a run in a new world, with the robot and the doors that are configured now.

    Args:
        log: Log of the run, as `World.log` returns it.

    Returns:
        Log of the repeated run.

    Raises:
        SettingError: The log has lost orders, or is of a version with other settings.
        DoorModelError: There is no door of the log's name.
        ValueError: Settings or orders are no JSON.
    """
    settings = json.loads(str(log["settings"])) | {"gui": False}
    other = settings.keys() ^ {field.name for field in fields(WorldSettings)}
    if other:
        raise SettingError(
            "settings that only the log or only this version has", ", ".join(sorted(other)),
            "none")
    settings["sensors"] = SensorSettings(**settings["sensors"])
    place = float(log["door_distance"]), float(log["hinge_x"])
    world = World(load_robot_config(), load_door(str(log["door"])), *place, **settings)
    try:
        replay(world, str(log["commands"]), int(log["ticks"]))
        return world.log(with_com="com_position" in log)
    finally:
        world.close()


def differences(log: dict[str, Any], again: dict[str, Any]) -> list[str]:
    """Return the names of the columns that differ in any bit, except the settings."""
    names = (log.keys() | again.keys()) - {"settings"}
    return sorted(
        name for name in names
        if name not in log or name not in again or not np.array_equal(
            log[name], again[name], equal_nan=np.asarray(log[name]).dtype.kind == "f"
        )
    )


def main(args: list[str] | None = None) -> int:
    """Repeat a run from its log and report whether both runs are the same.

    Args:
        args: Command line; the default is that of the process.

    Returns:
        0 if they are the same, 1 if they differ or the log cannot be replayed.
    """
    parser = argparse.ArgumentParser(prog="replay", description=_DESCRIPTION)
    parser.add_argument("log", type=Path, help="simulation.npz of a demonstration, or ~/save_log's")
    path: Path = parser.parse_args(args).log
    try:
        with np.load(path) as data:
            log = dict(data)
        different = differences(log, replay_log(log))
    except KeyError as error:
        missing = error.args[0]
        print(f"replay: {path} is not a log of the simulation: it has no {missing}",
              file=sys.stderr)
        return 1
    except (DoorImpactError, OSError) as error:
        print(f"replay: {path}: {error}", file=sys.stderr)
        return 1
    except (ValueError, TypeError) as error:  # no archive, or other contents
        print(f"replay: {path} is not a log of the simulation: {error}", file=sys.stderr)
        return 1
    seconds = float(log["time"][-1])
    if different:
        print(f"{seconds:.1f} s replayed; the runs differ in {', '.join(different)}")
        return 1
    print(f"{seconds:.1f} s replayed: the same run, bit for bit in {len(log)} columns")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The physics engines that exist; a new one is entered here and in `settings.ENGINES`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.mujoco.engine import MuJoCoEngine
from hrp2_sim_bridge.physics.pybullet.engine import PyBulletEngine
from hrp2_sim_bridge.settings import WorldSettings

_ENGINES: Mapping[str, Callable[[], Engine]] = {
    "pybullet": PyBulletEngine, "mujoco": MuJoCoEngine}


def make_engine(name: str = WorldSettings.engine) -> Engine:
    """Return a new engine without a scene.

    Args:
        name: One of `settings.ENGINES`.

    Raises:
        SimulatorMissingError: The engine is not installed.
    """
    return _ENGINES[name]()

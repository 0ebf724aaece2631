"""The physics engines that exist; a new one is entered here."""

from __future__ import annotations

from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.pybullet.engine import PyBulletEngine


def make_engine() -> Engine:
    """Return a new engine without a scene: PyBullet, the only one so far."""
    return PyBulletEngine()

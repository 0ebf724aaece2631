"""PyBullet itself: the import, and one client of its physics server."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError

from hrp2_sim_bridge.errors import SimulatorMissingError

# Functions that are called in every step or tick.
_OFTEN = (
    "stepSimulation", "getJointState", "getJointStates", "getLinkStates", "getContactPoints",
    "getBasePositionAndOrientation", "getBaseVelocity", "multiplyTransforms",
    "setJointMotorControl2", "setJointMotorControlArray")


def load_pybullet() -> Any:
    """Import and return the module `pybullet`.

    Raises:
        SimulatorMissingError: PyBullet is not installed.
    """
    try:
        with _quiet():
            import pybullet
    except ImportError as error:
        raise SimulatorMissingError from error
    return pybullet


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress PyBullet's greeting: both standard streams belong to the user of this module."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(stream) for stream in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        yield
    finally:
        ctypes.CDLL(None).fflush(None)  # otherwise the greeting appears later
        for stream, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, stream)
            os.close(copy)
        os.close(nowhere)


def connect(gui: bool) -> Any:
    """Return a client of a new physics server, in this process or in a window of its own.

    Raises:
        SimulatorMissingError: PyBullet is not installed.
        SettingError: There is no display for a window.
    """
    if gui and sys.platform == "linux" and not os.environ.get("DISPLAY"):
        # PyBullet would end the process without a message.
        raise SettingError("gui", gui, "false where DISPLAY names no display")
    pybullet = load_pybullet()
    # This module comes with PyBullet.
    from pybullet_utils.bullet_client import BulletClient

    with _quiet():
        client = BulletClient(pybullet.GUI if gui else pybullet.DIRECT)
    for name in _OFTEN:
        # BulletClient looks a function up at each call, which takes longer than some of the calls.
        setattr(client, name, getattr(client, name))
    if gui:
        client.configureDebugVisualizer(client.COV_ENABLE_GUI, 0)
        client.resetDebugVisualizerCamera(2.6, 120.0, -18.0, [0.0, -0.2, 0.7])
    return client


def prepare(client: Any, time_step: float, iterations: int, friction: float) -> int:
    """Empty the world, set its physics and add the floor; return PyBullet's index of the floor.

    Args:
        client: Client of PyBullet.
        time_step: Length of a physics step [s].
        iterations: Number of the solver's iterations in each step.
        friction: Coefficient of friction between soles and floor.
    """
    client.resetSimulation()
    client.setGravity(0.0, 0.0, -GRAVITY)
    client.setPhysicsEngineParameter(
        fixedTimeStep=time_step,
        numSolverIterations=iterations,
        numSubSteps=0,
        deterministicOverlappingPairs=1)
    plane = client.createCollisionShape(client.GEOM_PLANE)
    floor = client.createMultiBody(0.0, plane)
    # PyBullet multiplies the friction of the two bodies; the floor has the value of the pair.
    client.changeDynamics(floor, -1, lateralFriction=friction, restitution=0.0)
    return int(floor)

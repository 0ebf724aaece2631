"""Drop test: a free ball on the leaf, to see the restitution that its surface shows."""

from __future__ import annotations

from dataclasses import dataclass

from door_model.door.config import DoorConfig

from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.physics.door_body import DoorBody
from hrp2_sim_bridge.physics.engine import connect, prepare
from hrp2_sim_bridge.settings import WorldSettings

_RADIUS = 0.05  # of the ball, as of the robot's elbow [m]
_DISTANCE = 0.4  # of the leaf's face from the origin [m]
_GAP = 0.01  # between ball and leaf at first [m]
_HEIGHT = 0.9  # of the ball [m]
_AFTERWARDS = 0.04  # watched after the time in which the ball comes [s]


@dataclass(frozen=True)
class DropTest:
    """What a free ball and the leaf did.

    Attributes:
        restitution: speed of separation over speed of approach.
        momentum_ratio: angular momentum about the hinge after over before; 1 is conservation.
        duration: of the contact [s].
    """

    restitution: float
    momentum_ratio: float
    duration: float


def drop_test(
    door: DoorConfig, design: ContactDesign, *, mass: float, lever: float, speed: float,
    step: float,
) -> DropTest:
    """Let a ball without gravity hit a leaf without closer.

    Args:
        door: whose leaf is hit.
        design: of the leaf's surface.
        mass: of the ball [kg].
        lever: distance of the hit from the hinge [m].
        speed: of the ball [m/s].
        step: physics step [s].
    """
    client = connect(False)
    try:
        prepare(client, step, WorldSettings.iterations, WorldSettings.friction)
        client.setGravity(0.0, 0.0, 0.0)
        leaf = DoorBody(client, door, _DISTANCE, -lever, design)
        sphere = client.createCollisionShape(client.GEOM_SPHERE, radius=_RADIUS)
        start = [0.0, -_DISTANCE + _RADIUS + _GAP, _HEIGHT]
        ball = client.createMultiBody(mass, sphere, basePosition=start)
        client.changeDynamics(ball, -1, linearDamping=0.0, angularDamping=0.0)
        client.resetBaseVelocity(ball, [0.0, -speed, 0.0])
        touching = 0
        for _ in range(int((2.0 * _GAP / speed + _AFTERWARDS) / step)):
            client.stepSimulation()
            touching += any(c[9] > 0.0 for c in client.getContactPoints(ball, leaf.body))
        after = -client.getBaseVelocity(ball)[0][1]
        omega = leaf.state().velocity
    finally:
        client.disconnect()
    momentum = mass * after * lever + door.i_a * omega
    return DropTest(
        (omega * lever - after) / speed, momentum / (mass * speed * lever), touching * step
    )

"""Drop test: a free ball hits the leaf and shows the restitution of the leaf's surface."""

from __future__ import annotations

from dataclasses import dataclass

from door_model.door.config import DoorConfig

from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.physics.pybullet.client import connect, prepare
from hrp2_sim_bridge.physics.pybullet.leaf import LeafBody
from hrp2_sim_bridge.settings import WorldSettings

_RADIUS = 0.05  # radius of the ball, the same as that of the robot's elbow [m]
_DISTANCE = 0.4  # distance of the leaf's face from the origin [m]
_GAP = 0.01  # distance between ball and leaf at the start [m]
_HEIGHT = 0.9  # height of the ball above the floor [m]
_FORCE = 9  # entry of the normal force in PyBullet's contact points
_AFTERWARDS = 0.04  # simulated time after the ball has reached the leaf [s]


@dataclass(frozen=True)
class DropTest:
    """Result of a drop test.

    Attributes:
        restitution: Speed of separation divided by speed of approach.
        momentum_ratio: Angular momentum about the hinge after the contact divided by that before
            it; 1 if it is conserved.
        duration: Duration of the contact [s].
    """

    restitution: float
    momentum_ratio: float
    duration: float


def drop_test(
    door: DoorConfig, design: ContactDesign, *, mass: float, lever: float, speed: float,
    step: float,
) -> DropTest:
    """Let a ball hit a leaf without gravity and without closer.

    Args:
        door: Configuration of the door.
        design: Surface of the leaf.
        mass: Mass of the ball [kg].
        lever: Distance of the hit from the hinge [m].
        speed: Speed of the ball towards the leaf [m/s].
        step: Physics step [s].

    Raises:
        SimulatorMissingError: PyBullet is not installed.
    """
    client = connect(False)
    try:
        prepare(client, step, WorldSettings.iterations, WorldSettings.friction)
        client.setGravity(0.0, 0.0, 0.0)
        leaf = LeafBody(client, door, _DISTANCE, -lever, design)
        sphere = client.createCollisionShape(client.GEOM_SPHERE, radius=_RADIUS)
        start = [0.0, -_DISTANCE + _RADIUS + _GAP, _HEIGHT]
        ball = client.createMultiBody(mass, sphere, basePosition=start)
        client.changeDynamics(ball, -1, linearDamping=0.0, angularDamping=0.0)
        client.resetBaseVelocity(ball, [0.0, -speed, 0.0])
        touching = 0
        for _ in range(int((2.0 * _GAP / speed + _AFTERWARDS) / step)):
            client.stepSimulation()
            contacts = client.getContactPoints(ball, leaf.body)
            touching += any(contact[_FORCE] > 0.0 for contact in contacts)
        after = -client.getBaseVelocity(ball)[0][1]
        omega = leaf.state().velocity
    finally:
        client.disconnect()
    momentum = mass * after * lever + door.i_a * omega
    return DropTest(
        (omega * lever - after) / speed, momentum / (mass * speed * lever), touching * step
    )

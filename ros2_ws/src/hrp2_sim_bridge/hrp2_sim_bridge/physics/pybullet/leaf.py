"""The door's leaf on its hinge in PyBullet."""

from __future__ import annotations

from functools import partial
from typing import Any

from door_model.door.config import DoorConfig
from door_model.door.geometry import along

from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.physics.engine import DoorState
from hrp2_sim_bridge.settings import WorldSettings

HINGE = 0  # PyBullet's index of the hinge's joint


class LeafBody:
    """The leaf; its face towards the robot lies in the plane y = -door_distance when closed.

    The leaf's free edge moves towards -y when it opens, about -z if it is hinged at the right.
    PyBullet knows neither closer nor stops; `DoorLoad` computes their torque.

    Args:
        client: Client of PyBullet.
        config: Configuration of the door.
        door_distance: Distance of the leaf's face from the world's origin [m].
        hinge_x: x of the hinge [m].
        contact: Surface of the leaf.
        friction: Coefficient of friction of the surface.

    Attributes:
        body: PyBullet's index of the leaf.
    """

    def __init__(
        self,
        client: Any,
        config: DoorConfig,
        door_distance: float,
        hinge_x: float,
        contact: ContactDesign,
        friction: float = WorldSettings.leaf_friction,
    ) -> None:
        self._client = client
        self.body = _create_leaf(client, config, door_distance, hinge_x)
        client.changeDynamics(
            self.body, HINGE,
            # The inertial frame is at the hinge, so this is the moment of inertia about the hinge.
            localInertiaDiagonal=[config.i_a] * 3,
            linearDamping=0.0, angularDamping=0.0, jointDamping=0.0,
            lateralFriction=friction, restitution=0.0,
            contactStiffness=contact.stiffness, contactDamping=contact.damping)
        client.setJointMotorControl2(self.body, HINGE, client.VELOCITY_CONTROL, force=0.0)
        self._apply = partial(
            client.setJointMotorControl2, self.body, HINGE, client.TORQUE_CONTROL)

    def state(self) -> DoorState:
        """Return angle and angular velocity."""
        return DoorState(*self._client.getJointState(self.body, HINGE)[:2])

    def apply_torque(self, torque: float) -> None:
        """Apply a torque about the hinge [N m] during the coming physics step."""
        self._apply(force=torque)


def _create_leaf(client: Any, config: DoorConfig, door_distance: float, hinge_x: float) -> int:
    leaf, side = config.leaf, along(config.hinge)
    half = [leaf.width / 2.0, leaf.thickness / 2.0, leaf.height / 2.0]
    x, y, z = leaf.center()
    centre = side * x, y, z
    box = client.createCollisionShape(
        client.GEOM_BOX, halfExtents=half, collisionFramePosition=centre)
    picture = client.createVisualShape(
        client.GEOM_BOX, halfExtents=half, visualFramePosition=centre,
        rgbaColor=[0.72, 0.53, 0.35, 1.0])
    return int(
        client.createMultiBody(
            baseMass=0.0, basePosition=[hinge_x, -door_distance, 0.0], linkMasses=[leaf.mass],
            linkCollisionShapeIndices=[box], linkVisualShapeIndices=[picture],
            linkPositions=[[0.0, 0.0, 0.0]], linkOrientations=[[0.0, 0.0, 0.0, 1.0]],
            linkInertialFramePositions=[[0.0, 0.0, 0.0]],
            linkInertialFrameOrientations=[[0.0, 0.0, 0.0, 1.0]], linkParentIndices=[0],
            linkJointTypes=[client.JOINT_REVOLUTE], linkJointAxis=[[0.0, 0.0, -side]]))

"""Drop test: a free ball hits the leaf and shows the restitution of the leaf's surface."""

from __future__ import annotations

from dataclasses import dataclass

from door_model.door.config import DoorConfig

from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.physics.mujoco.engine import load_mujoco
from hrp2_sim_bridge.physics.mujoco.model import HINGE, LEAF, add_leaf, compile_model, leaf_surface
from hrp2_sim_bridge.physics.mujoco.model import prepare as prepare_mujoco
from hrp2_sim_bridge.physics.pybullet.client import connect, prepare
from hrp2_sim_bridge.physics.pybullet.leaf import LeafBody
from hrp2_sim_bridge.settings import WorldSettings

_RADIUS = 0.05  # radius of the ball, the same as that of the robot's elbow [m]
_DISTANCE = 0.4  # distance of the leaf's face from the origin [m]
_GAP = 0.01  # distance between ball and leaf at the start [m]
_HEIGHT = 0.9  # height of the ball above the floor [m]
_FORCE = 9  # entry of the normal force in PyBullet's contact points
_AFTERWARDS = 0.04  # simulated time after the ball has reached the leaf [s]
_BALL = "ball"
_Outcome = tuple[float, float, int]  # speeds of ball [m/s] and leaf [rad/s], steps with contact
_START = (0.0, -_DISTANCE + _RADIUS + _GAP, _HEIGHT)


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
    step: float, sliding: float = 0.0, engine: str = WorldSettings.engine,
) -> DropTest:
    """Let a ball hit a leaf with a designed surface, without gravity and without closer.

    Args:
        door: Configuration of the door.
        design: Surface of the leaf.
        mass: Mass of the ball [kg].
        lever: Distance of the hit from the hinge [m].
        speed: Speed of the ball towards the leaf [m/s].
        step: Physics step [s].
        sliding: Speed of the ball along the leaf, upwards [m/s].
        engine: Name of the physics engine.

    Raises:
        SimulatorMissingError: The engine is not installed.
    """
    run = {"pybullet": _in_pybullet, "mujoco": _in_mujoco}[engine]
    steps = int((2.0 * _GAP / speed + _AFTERWARDS) / step)
    velocity = (0.0, -speed, sliding)
    after, omega, touching = run(door, design, mass, lever, velocity, step, steps)
    momentum = mass * after * lever + door.i_a * omega
    return DropTest(
        (omega * lever - after) / speed, momentum / (mass * speed * lever), touching * step)


def _in_pybullet(
    door: DoorConfig, design: ContactDesign, mass: float, lever: float,
    velocity: tuple[float, float, float], step: float, steps: int,
) -> _Outcome:
    client = connect(False)
    try:
        prepare(client, step, WorldSettings.iterations, WorldSettings.friction)
        client.setGravity(0.0, 0.0, 0.0)
        leaf = LeafBody(client, door, _DISTANCE, -lever, design)
        sphere = client.createCollisionShape(client.GEOM_SPHERE, radius=_RADIUS)
        ball = client.createMultiBody(mass, sphere, basePosition=_START)
        client.changeDynamics(ball, -1, linearDamping=0.0, angularDamping=0.0)
        client.resetBaseVelocity(ball, velocity)
        touching = 0
        for _ in range(steps):
            client.stepSimulation()
            contacts = client.getContactPoints(ball, leaf.body)
            touching += any(contact[_FORCE] > 0.0 for contact in contacts)
        return -client.getBaseVelocity(ball)[0][1], leaf.state().velocity, touching
    finally:
        client.disconnect()


def _in_mujoco(
    door: DoorConfig, design: ContactDesign, mass: float, lever: float,
    velocity: tuple[float, float, float], step: float, steps: int,
) -> _Outcome:
    mujoco = load_mujoco()
    spec = prepare_mujoco(mujoco, mujoco.MjSpec(), WorldSettings.iterations)
    spec.option.gravity = [0.0, 0.0, 0.0]
    add_leaf(mujoco, spec, door, _DISTANCE, -lever)
    body = spec.worldbody.add_body(name=_BALL, pos=_START)
    body.add_freejoint(name=_BALL)
    body.add_geom(
        name=_BALL, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[_RADIUS, 0.0, 0.0], mass=mass,
        contype=0, conaffinity=0)
    wood = leaf_surface(design, WorldSettings.leaf_friction)
    model = compile_model(spec, [(LEAF, _BALL, wood)], step).raw
    data = mujoco.MjData(model)
    ball, hinge = data.joint(_BALL), data.joint(HINGE)
    ball.qvel[:3] = velocity
    touching = 0
    for _ in range(steps):
        mujoco.mj_step(model, data)
        touching += bool((data.efc_force > 0.0).any())
    return -float(ball.qvel[1]), float(hinge.qvel[0]), touching

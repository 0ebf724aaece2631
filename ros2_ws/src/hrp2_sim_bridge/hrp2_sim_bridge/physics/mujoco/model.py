r"""MuJoCo's models of robot, floor and door, with contacts as spring-dampers in N/m and N s/m.

MuJoCo's contacts are soft constraints. With an acceleration `a`, a velocity `v` and a
penetration `x` along the normal, the normal force of a contact that presses obeys

    f = D (-a_n - b v_n + k x),

where v_n is the speed of separation, and MuJoCo computes `D = d / ((1 - d) A)` from the
impedance d (`solimp`) and an inverse mass A that it assigns to the pair of bodies. Given A, any
virtual mass D can be chosen by d, and any stiffness D k and damping D b by `solref`. The scheme of
`hrp2_sim_bridge.physics.contact`, which is implicit in the velocity, is met exactly by
`D = h (c + h k_0)` for a stiffness `k_0`, a damping c and a step h.

A contact that slides with a speed u along the surface gets an additional force
`mu D u / h`, because MuJoCo's cone of friction couples normal and tangent. Where that force
matters, in a hit, the virtual mass must be small. The damping is then explicit, and stiffness and
damping are smaller by the ratio of the moved masses, so that two bodies with the reduced mass for
which the surface was designed move exactly as before.

Source: "Computation", chapters "Constraint model" and "Solver parameters", of MuJoCo's
documentation.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.constants import GRAVITY
from door_model.door.config import DoorConfig
from door_model.door.frame import THRESHOLD
from door_model.door.geometry import along
from hrp2_description.drives_and_pads import SoleRubber
from hrp2_description.robot import SIDES, RobotConfig

from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.contact import ContactDesign
from hrp2_sim_bridge.physics.engine import Scene, sensed_links
from hrp2_sim_bridge.physics.kinematics import sensed_bodies
from hrp2_sim_bridge.physics.shapes import simulated_urdf

WORLD, LEAF, HINGE, FLOOR = "world", "leaf", "hinge", "floor"
_CORNERS = 4  # contact points of a sole on the floor
_RIGID = (5e6, 1.2e4)  # stiffness [N/m] and damping [N s/m] of a contact without rubber
_FREE = "odom"  # name of the base's free joint
_WOOD, _PLASTER = (0.72, 0.53, 0.35, 1.0), (0.88, 0.88, 0.86, 0.5)
_TOLERANCE = 1e-10  # accuracy at which MuJoCo's solver stops
_LEAST_MASS = 0.02  # smallest virtual mass of a contact [kg]
# Explicit damping is stable up to h c = 2 m. MuJoCo's inverse mass is a mean over directions, along
# one of which a body may show a fraction of that mass m; so h c is kept below this share of it.
_STABLE_SHARE = 0.25
# Ratio of the virtual masses of friction and normal contact: large, so that soles do not creep.
# From 1e6 on MuJoCo's solver reports problems that are not convex.
_FRICTION_RATIO = 1e5
_GRIP = 0.9999  # impedance of constraints that are rigid; the largest that MuJoCo accepts
_GRIP_SHARE = 0.1  # share of an error that a rigid constraint removes in a step


@dataclass(frozen=True)
class Surface:
    """A surface as one contact point shows it.

    Attributes:
        stiffness: Stiffness [N/m].
        damping: Damping [N s/m].
        friction: Coefficient of friction.
        reduced_mass: Reduced mass of a hit for which the surface was designed [kg]; None where
            nothing hits, so that the contact is implicit.
    """

    stiffness: float
    damping: float
    friction: float
    reduced_mass: float | None = None


@dataclass(frozen=True)
class Model:
    """A compiled model and the surfaces of its contacts.

    Attributes:
        raw: MuJoCo's model.
        surfaces: Surface of each pair of geoms by the pair's index.
    """

    raw: Any
    surfaces: Mapping[int, Surface]

    def set_time_step(self, step: float) -> None:
        """Set the length of the coming physics steps [s] and keep the surfaces."""
        self.raw.opt.timestep = step
        for pair, surface in self.surfaces.items():
            _set_surface(self.raw, pair, surface, step)
        _set_grips(self.raw, step)


def prepare(mujoco: Any, spec: Any, iterations: int) -> Any:
    """Set the physics of a specification and the most iterations of its solver; return it."""
    spec.compiler.degree = False
    option = spec.option
    option.gravity = [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = _FRICTION_RATIO
    # A state that is no number must be noticed; MuJoCo would start again from its first state.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    option.iterations, option.tolerance = iterations, _TOLERANCE
    return spec


def add_leaf(mujoco: Any, spec: Any, config: DoorConfig, distance: float, hinge_x: float) -> Any:
    """Add the leaf, whose face towards the robot lies in the plane y = -distance when closed.

    The leaf's free edge moves towards -y when it opens, about -z if it is hinged at the right.
    `DoorLoad` computes the torques of closer and stops. Lengths are in [m]; the leaf's geom is
    returned.
    """
    leaf, side = config.leaf, along(config.hinge)
    x, y, z = leaf.center()
    body = spec.worldbody.add_body(name=LEAF, pos=[hinge_x, -distance, 0.0])
    # The center of mass is put into the hinge, so this is the moment of inertia about the hinge.
    body.explicitinertial, body.mass, body.inertia = True, leaf.mass, [config.i_a] * 3
    body.ipos, body.iquat = [0.0] * 3, [1.0, 0.0, 0.0, 0.0]  # otherwise MuJoCo takes `pos` twice
    body.add_joint(name=HINGE, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, -side])
    return body.add_geom(
        name=LEAF, type=mujoco.mjtGeom.mjGEOM_BOX, pos=[side * x, y, z], rgba=_WOOD,
        size=[leaf.width / 2.0, leaf.thickness / 2.0, leaf.height / 2.0],
        contype=0, conaffinity=0)


def leaf_surface(design: ContactDesign, friction: float) -> Surface:
    """Return the surface of a leaf with a coefficient of friction."""
    return Surface(design.stiffness, design.damping, friction, design.reduced_mass)


def compile_model(spec: Any, pairs: list[tuple[str, str, Surface]], step: float) -> Model:
    """Compile a specification for a physics step [s].

    Only the named pairs of geoms may touch; each has a surface.
    """
    for first, second, surface in pairs:
        sliding = [surface.friction] * 2
        spec.add_pair(
            geomname1=first, geomname2=second, condim=3, friction=[*sliding, 0.0, 0.0, 0.0])
    raw = spec.compile()
    names = {
        (raw.geom(raw.pair_geom1[pair]).name, raw.geom(raw.pair_geom2[pair]).name): pair
        for pair in range(raw.npair)}
    model = Model(raw, {
        names.get((first, second), names.get((second, first), -1)): surface
        for first, second, surface in pairs})
    model.set_time_step(step)
    return model


def build(mujoco: Any, scene: Scene) -> Model:
    """Build robot, floor, leaf and frame of a scene.

    Raises:
        ModelError: MuJoCo refuses the robot or changed its mass.
        RobotConfigError: The robot's configuration lacks something that the simulation needs.
    """
    robot, settings = scene.robot, scene.settings
    spec = robot_spec(mujoco, robot, settings.iterations, visible=settings.gui)
    soles = [robot.feet[side].sole for side in SIDES]
    geoms = _name_shapes(spec)
    bodies = sensed_bodies(robot)
    for link, carrier, place in zip(
            sensed_links(robot), bodies.carriers, bodies.places, strict=True):
        _add_sensors(mujoco, spec, link, carrier, place)
    spec.worldbody.add_geom(
        name=FLOOR, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[10.0, 10.0, 1.0],
        contype=0, conaffinity=0)
    add_leaf(mujoco, spec, scene.door, scene.door_distance, scene.hinge_x)
    boxes = scene.frame_boxes
    for box in boxes:
        spec.worldbody.add_geom(
            name=box.name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=box.center, size=box.half,
            rgba=_PLASTER, contype=0, conaffinity=0)
    hard = Surface(*_RIGID, settings.friction)
    rubber = scene.sole_rubber
    standing = hard if rubber is None else _sole_surface(rubber, settings.friction)
    wood = leaf_surface(scene.contact, settings.leaf_friction)
    pairs = [(LEAF, geom, wood) for geom in geoms]
    wall = Surface(*_RIGID, settings.leaf_friction)
    names = [box.name for box in boxes]
    pairs += [(name, geom, wall) for name in names if name != THRESHOLD for geom in geoms]
    pairs += [
        (floor, geom, standing if body in soles else hard)
        for floor in (FLOOR, *(name for name in names if name == THRESHOLD))
        for geom, body in geoms.items()]
    try:
        model = compile_model(spec, pairs, settings.time_step_coarse)
    except ValueError as error:
        raise ModelError(robot.name, str(error), "accepted by MuJoCo", "the model") from error
    mass = float(model.raw.body_subtreemass[model.raw.body(robot.root_link).id])
    if not np.isclose(mass, robot.mass, rtol=1e-7):
        raise ModelError(robot.name, mass, robot.mass, "mass [kg]")
    return model


def robot_spec(mujoco: Any, robot: RobotConfig, iterations: int, *, visible: bool) -> Any:
    """Return a specification with the free robot, each of whose joints can be held.

    Its visible shapes are kept only if they shall be seen.

    Raises:
        ModelError: MuJoCo refuses the URDF.
    """
    spec = prepare(mujoco, _read_robot(mujoco, robot, visible), iterations)
    spec.body(robot.root_link).add_freejoint(name=_FREE)
    for joint in robot.joint_names:
        spec.add_equality(
            name=joint, name1=joint, type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT, active=False)
    return spec


def _read_robot(mujoco: Any, robot: RobotConfig, visible: bool) -> Any:
    """Read the URDF without merging bodies that are fixed to each other.

    Raises:
        ModelError: MuJoCo refuses the URDF.
    """
    tree = ET.parse(simulated_urdf(robot))
    for picture in tree.getroot().iter("visual"):
        picture.attrib.pop("name", None)  # MuJoCo has one name space for all geoms
    extension = ET.SubElement(tree.getroot(), "mujoco")
    ET.SubElement(
        extension, "compiler", fusestatic="false", discardvisual="false" if visible else "true",
        strippath="false")
    try:
        return mujoco.MjSpec.from_string(ET.tostring(tree.getroot(), encoding="unicode"))
    except ValueError as error:
        raise ModelError(robot.name, str(error), "accepted by MuJoCo", "the URDF") from error


def _name_shapes(spec: Any) -> dict[str, str]:
    """Name every shape that may touch something; return its body's name by its own."""
    bodies = {}
    for index, geom in enumerate(spec.geoms):
        if geom.contype:
            geom.name = f"shape {index}"
            geom.contype = geom.conaffinity = 0  # only the named pairs touch
            bodies[geom.name] = geom.parent.name
    return bodies


def _add_sensors(mujoco: Any, spec: Any, link: str, carrier: str, place: Any) -> None:
    """Measure force and torque on a carrier by its parent, in a link's frame, placed in it."""
    x, y, z, w = pin.Quaternion(place.rotation).coeffs()
    spec.body(carrier).add_site(name=link, pos=place.translation, quat=[w, x, y, z])
    for kind in (mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE):
        spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=link)


def _sole_surface(rubber: SoleRubber, friction: float) -> Surface:
    """Return the surface of a corner of a rubber sole."""
    return Surface(rubber.stiffness / _CORNERS, rubber.damping / _CORNERS, friction)


def _set_surface(model: Any, pair: int, surface: Surface, step: float) -> None:
    """Give a pair of geoms, by its index, the surface for physics steps of one length [s]."""
    damping = surface.damping + step * surface.stiffness
    bodies = model.geom_bodyid[[model.pair_geom1[pair], model.pair_geom2[pair]]]
    inverse = float(model.body_invweight0[bodies, 0].sum())
    implicit = step * damping
    virtual, scale = implicit, 1.0
    if surface.reduced_mass is not None:
        virtual = min(max(implicit - _STABLE_SHARE / inverse, _LEAST_MASS), implicit)
        scale = (surface.reduced_mass + virtual) / (surface.reduced_mass + implicit)
    impedance = inverse * virtual / (1.0 + inverse * virtual)
    share = scale * impedance / virtual
    model.pair_solimp[pair, :2] = impedance
    model.pair_solref[pair] = -share * surface.stiffness, -share * damping
    model.pair_solreffriction[pair] = 0.0, -impedance / step


def _set_grips(model: Any, step: float) -> None:
    """Make equality constraints and limits of joints as stiff as a step [s] allows."""
    reference = np.array([-_GRIP * _GRIP_SHARE / step**2, -_GRIP / step])
    model.eq_solref[:], model.jnt_solref[:] = reference, reference
    model.eq_solimp[:, :2] = model.jnt_solimp[:, :2] = _GRIP

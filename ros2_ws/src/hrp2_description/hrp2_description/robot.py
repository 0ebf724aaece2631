"""The robot's configuration (config/robot.yaml) together with the limits of its URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from hrp2_description.data import data_path
from hrp2_description.errors import DataFileNotFoundError, RobotConfigError

Array = NDArray[np.float64]
Rect = tuple[float, float, float, float]
# Signs of mirrored joint angles, by number in the chain: yaws and rolls turn the other way.
MIRROR_SIGNS = {
    "LLEG": (-1.0, -1.0, 1.0, 1.0, 1.0, -1.0),
    "LARM": (1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0),
}


@dataclass(frozen=True)
class Foot:
    """Names in the URDF that belong to one foot.

    Attributes:
        sole: Link of the sole (REP-120 ``l_sole`` or ``r_sole``), on the floor below the ankle.
        ankle: Link that the ankle-roll joint moves.
        sensor_joint: Fixed joint above the sole in which the force sensor sits.
    """

    sole: str
    ankle: str
    sensor_joint: str


@dataclass(frozen=True)
class SoleRubber:
    """Rubber under one whole sole, along the vertical.

    Attributes:
        stiffness: [N/m].
        damping: [N s/m].
    """

    stiffness: float
    damping: float


@dataclass(frozen=True, eq=False)
class RobotConfig:
    """HRP-2 as the nodes need it. Arrays are (30,), in the order of ``joint_names``, read-only.

    Attributes:
        name: Name of the robot in its URDF.
        mass: Total mass [kg], the sum over the URDF.
        joint_names: The robot's own order: RLEG, LLEG, CHEST, HEAD, RARM, LARM.
        half_sitting: Initial posture [rad].
        gear_ratio: Motor turns per joint turn [-].
        rotor_inertia: Rotor inertia at the motor [kg m^2].
        rotor_link: For each joint named, ``child`` or ``parent``: the link on which a simulation
            without rotors puts the inertia of the joint's.
        motor_encoder_counts: Counts of a motor's encoder a motor turn.
        servo_time_constant: Of the decay of a servo's position error [s].
        lower: Lower joint limits [rad].
        upper: Upper joint limits [rad].
        velocity_limit: Largest joint speeds [rad/s].
        effort_limit: Largest joint torques [N m].
        soles: ``left`` and ``right``: (x_min, x_max, y_min, y_max) [m] in the sole's frame.
        sole_rubber: Rubber between an ankle and the floor.
        feet: ``left`` and ``right``: link and joint names.
        imu_frame: Link in which the IMU sits.
        contact_link: Link whose origin is the middle of the body that hits the door.
        contact_radius: Radius of that body [m].
        hand_link: Link at the middle of the right hand.
        braced_posture: Right arm's joint angles during the hit [rad].
        braced_joints: Joints that the brace relieves.
        urdf_path: The URDF file.
    """

    name: str
    mass: float
    joint_names: tuple[str, ...]
    half_sitting: Array
    gear_ratio: Array
    rotor_inertia: Array
    rotor_link: Mapping[str, str]
    motor_encoder_counts: int
    servo_time_constant: float
    lower: Array
    upper: Array
    velocity_limit: Array
    effort_limit: Array
    soles: Mapping[str, Rect]
    sole_rubber: SoleRubber
    feet: Mapping[str, Foot]
    imu_frame: str
    contact_link: str
    contact_radius: float
    hand_link: str
    braced_posture: Mapping[str, float]
    braced_joints: tuple[str, ...]
    urdf_path: Path

    @property
    def armature(self) -> Array:
        """Rotor inertia felt at the joint, gear^2 times rotor_inertia (30,) [kg m^2]."""
        reflected: Array = self.gear_ratio**2 * self.rotor_inertia
        return reflected

    @property
    def joint_resolution(self) -> Array:
        """Joint angle of a count of the motor's encoder (30,) [rad]."""
        resolution: Array = 2.0 * np.pi / (self.motor_encoder_counts * self.gear_ratio)
        return resolution

    def index(self, joint: str) -> int:
        """Return the joint's place in the (30,) arrays.

        Raises:
            RobotConfigError: If there is no such joint.
        """
        try:
            return self.joint_names.index(joint)
        except ValueError:
            raise RobotConfigError(
                "no such joint", value=joint, limit="a name of joint_names"
            ) from None

    def posture(self, joints: Mapping[str, float], base: Array | None = None) -> Array:
        """Return a (30,) posture [rad]: ``base`` (half-sitting by default) with some joints set."""
        angles = np.array(self.half_sitting if base is None else base, dtype=float)
        for joint, angle in joints.items():
            angles[self.index(joint)] = angle
        return angles


def load_robot_config(path: str | Path | None = None) -> RobotConfig:
    """Read the robot's configuration.

    Args:
        path: A YAML file like config/robot.yaml, which is the default. Its ``urdf`` is found
            beside it, in its parent folder or among this package's data.

    Raises:
        RobotConfigError: If a field is missing, unusable, or contradicts the URDF.
        OSError: If the file cannot be opened.
    """
    file = Path(path) if path is not None else data_path("config/robot.yaml")
    try:
        data = yaml.safe_load(file.read_text(encoding="utf-8"))
        if not isinstance(data, dict):
            raise RobotConfigError(f"{file} is no mapping", value=data, limit="a mapping")
        return _build(data, _find_urdf(str(data["urdf"]), file))
    except RobotConfigError:
        raise
    except KeyError as error:
        raise RobotConfigError(f"{file}: missing field", value=None, limit=error.args[0]) from error
    except (yaml.YAMLError, ET.ParseError, AttributeError, TypeError, ValueError) as error:
        raise RobotConfigError(
            f"{file} cannot be read", value=str(error), limit="fields as in config/robot.yaml"
        ) from error


def _build(data: dict[str, Any], urdf_path: Path) -> RobotConfig:
    names = tuple(data["joint_names"])
    robot = ET.parse(urdf_path).getroot()
    limits = _read_limits(robot, names)
    gear = {chain: row["gear"] for chain, row in data["actuators"].items()}
    rotor = {chain: row["rotor_inertia"] for chain, row in data["actuators"].items()}
    half_sitting = np.deg2rad(_per_joint(data["half_sitting_deg"], names, mirror=True))
    braced = {name: float(np.deg2rad(deg)) for name, deg in data["braced_posture_deg"].items()}
    feet = {side: Foot(**data["feet"][side]) for side in ("left", "right")}
    x_min, x_max, y_min, y_max = (float(value) for value in data["sole"])
    config = RobotConfig(
        name=data["name"],
        mass=sum(float(element.attrib["value"]) for element in robot.iter("mass")),
        joint_names=names,
        half_sitting=_frozen(half_sitting),
        gear_ratio=_frozen(_per_joint(gear, names)),
        rotor_inertia=_frozen(_per_joint(rotor, names)),
        rotor_link=MappingProxyType(_rotor_links(data["rotor_link"])),
        motor_encoder_counts=data["motor_encoder_counts"],
        servo_time_constant=_positive(data, "servo_time_constant"),
        lower=_frozen(limits[:, 0]),
        upper=_frozen(limits[:, 1]),
        velocity_limit=_frozen(limits[:, 2]),
        effort_limit=_frozen(limits[:, 3]),
        soles=MappingProxyType(
            {"left": (x_min, x_max, -y_max, -y_min), "right": (x_min, x_max, y_min, y_max)}
        ),
        sole_rubber=_sole_rubber(data["sole_rubber"]),
        feet=MappingProxyType(feet),
        imu_frame=data["imu_frame"],
        contact_link=data["contact_link"],
        contact_radius=float(data["contact_radius"]),
        hand_link=data["hand_link"],
        braced_posture=MappingProxyType(braced),
        braced_joints=tuple(data["braced_joints"]),
        urdf_path=urdf_path,
    )
    _check(config, robot)
    return config


def _sole_rubber(data: dict[str, Any]) -> SoleRubber:
    rubber = SoleRubber(float(data["stiffness"]), float(data["damping"]))
    for name, value in asdict(rubber).items():
        if not (np.isfinite(value) and value > 0.0):
            raise RobotConfigError(f"{name} of sole_rubber", value=value, limit="positive")
    return rubber


def _check(config: RobotConfig, robot: ET.Element) -> None:
    links = {element.attrib["name"] for element in robot.findall("link")}
    joints = {element.attrib["name"] for element in robot.findall("joint")}
    named_links = {config.imu_frame, config.contact_link, config.hand_link}
    named_joints = {*config.braced_joints, *config.braced_posture, *config.rotor_link}
    for foot in config.feet.values():
        named_links |= {foot.sole, foot.ankle}
        named_joints.add(foot.sensor_joint)
    for what, named, known in (("links", named_links, links), ("joints", named_joints, joints)):
        if named - known:
            raise RobotConfigError(
                f"{what} that the URDF lacks", value=sorted(named - known), limit=f"{what} of it"
            )
    counts = config.motor_encoder_counts
    if type(counts) is not int or counts < 1:
        raise RobotConfigError(
            "motor_encoder_counts", value=counts, limit="a whole number, 1 or more"
        )
    postures = {
        "half_sitting": config.half_sitting,
        "braced": config.posture(config.braced_posture),
    }
    for name, posture in postures.items():
        outside = (posture < config.lower) | (posture > config.upper)
        if outside.any():
            at = int(np.flatnonzero(outside)[0])
            raise RobotConfigError(
                f"{name} puts {config.joint_names[at]} outside its limits",
                value=float(posture[at]),
                limit=(float(config.lower[at]), float(config.upper[at])),
            )


def _positive(data: dict[str, Any], name: str) -> float:
    value = float(data[name])
    if not (np.isfinite(value) and value > 0.0):
        raise RobotConfigError(name, value=value, limit="a positive number")
    return value


def _rotor_links(chains: dict[str, list[str]]) -> dict[str, str]:
    links = {
        f"{chain}_JOINT{number}": link
        for chain, row in chains.items()
        for number, link in enumerate(row)
    }
    for joint, link in links.items():
        if link not in ("child", "parent"):
            raise RobotConfigError(f"rotor_link of {joint}", value=link, limit="child or parent")
    return links


def _read_limits(robot: ET.Element, names: tuple[str, ...]) -> Array:
    rows: dict[str, list[float]] = {}
    for joint in robot.findall("joint"):
        limit = joint.find("limit")
        if limit is not None:
            keys = ("lower", "upper", "velocity", "effort")
            rows[joint.attrib["name"]] = [float(limit.attrib[key]) for key in keys]
    if set(rows) != set(names) or len(set(names)) != len(names):
        different = sorted(set(rows) ^ set(names))
        raise RobotConfigError(
            "joint_names and the URDF's joints differ", value=different, limit="the same set"
        )
    return np.array([rows[name] for name in names])


def _per_joint(
    chains: dict[str, list[float]], names: tuple[str, ...], *, mirror: bool = False
) -> Array:
    values = []
    for name in names:
        chain, number = name.split("_JOINT")
        source = chains.get(chain)
        if source is None:
            source = chains["R" + chain[1:]]
        try:
            value = float(source[int(number)])
        except IndexError:
            raise RobotConfigError(
                f"no value for {name}", value=source, limit=f"at least {int(number) + 1} values"
            ) from None
        if mirror and chain in MIRROR_SIGNS and chain not in chains:
            value *= MIRROR_SIGNS[chain][int(number)]
        values.append(value + 0.0)
    return np.array(values)


def _find_urdf(name: str, config_file: Path) -> Path:
    for folder in (config_file.parent, config_file.parent.parent):
        if (folder / name).is_file():
            return folder / name
    try:
        return data_path(name)
    except DataFileNotFoundError:
        raise RobotConfigError(
            "the URDF is missing", value=name, limit=f"a file beside {config_file}"
        ) from None


def _frozen(values: Array) -> Array:
    values = np.array(values, dtype=float)
    values.setflags(write=False)
    return values
